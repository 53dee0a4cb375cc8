#include "tools/telesplat/movie/picture_sink.h"

#include <fmt/format.h>

#include <filesystem>

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class VideoSink final : public PictureSink {
 public:
  explicit VideoSink(std::unique_ptr<Encoder> encoder) : encoder_(std::move(encoder)) {}
  Status add(const image::View& picture, bool) override { return encoder_->add(picture); }
  Status finish() override { return encoder_->finish(); }
  std::string with() const override { return encoder_->name(); }

 private:
  std::unique_ptr<Encoder> encoder_;
};

class FolderSink final : public PictureSink {
 public:
  FolderSink(MovieTarget target, image::Alpha alpha, bool made)
      : target_(std::move(target)), alpha_(alpha), made_(made) {}
  ~FolderSink() override {
    if (done_) return;
    std::error_code error;
    for (uint64_t n = 0; n < count_; ++n) fs::remove(target_.picture(n), error);
    if (made_) fs::remove(target_.path, error);  // if it is empty
  }
  Status add(const image::View& picture, bool again) override {
    const std::string path = target_.picture(count_);
    if (again) {
      std::error_code error;
      fs::copy_file(target_.picture(count_ - 1), path, fs::copy_options::overwrite_existing, error);
      if (error) return Error{fmt::format("{}: cannot be written: {}", path, error.message())};
    } else if (const Status s = image::write_png(path, picture, alpha_); !s) {
      return s;
    }
    ++count_;
    return ok_status();
  }
  Status finish() override {
    done_ = true;
    return ok_status();
  }
  std::string with() const override { return "PNG"; }

 private:
  MovieTarget target_;
  image::Alpha alpha_;
  bool made_, done_ = false;
  uint64_t count_ = 0;
};

}  // namespace

Result<std::unique_ptr<PictureSink>> PictureSink::open(const MovieTarget& target, int width, int height, double fps,
                                                       image::Alpha alpha, const ShouldStop& should_stop) {
  const bool video = target.kind == MovieTarget::Kind::kVideo;
  const fs::path folder = video ? fs::path(target.path).parent_path() : fs::path(target.path);
  std::error_code error;
  const bool made = !folder.empty() && fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: cannot be made a folder: {}", folder.string(), error.message())};
  if (!video) return std::unique_ptr<PictureSink>(new FolderSink(target, alpha, made));
  auto encoder = Encoder::start(target.ffmpeg, target.path, width, height, fps, should_stop);
  if (!encoder) return encoder.error();
  return std::unique_ptr<PictureSink>(new VideoSink(std::move(*encoder)));
}

}  // namespace telesplat::launcher
