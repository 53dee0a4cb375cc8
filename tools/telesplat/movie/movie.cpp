#include "tools/telesplat/movie/movie.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "common/core/machine.h"
#include "tools/telesplat/movie/contact_sheet.h"
#include "tools/telesplat/movie/movie_target.h"
#include "tools/telesplat/movie/screen.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr double kMostFrames = 1e7;
constexpr int kSmallWidth = 400;  // width of a contact sheet's pictures

std::string cut_short(const Screen& screen, double t_s) {
  return fmt::format(
      "{} ends before frame {}: the record was cut short (--record-points limits it), and so this ends after {:.2f} s "
      "of "
      "{:.2f} s",
      screen.record_file(), screen.frame().number, t_s, screen.duration_s());
}

// Returns a shell line that makes a movie of the pictures.
std::string advice(const MovieTarget& target, double fps) {
  const std::string command =
      shell_line({"ffmpeg", "-framerate", fmt::format("{}", fps), "-i", target.pattern(), "-c:v", "libx264", "-crf",
                  "18", "-pix_fmt", "yuv420p", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", target.wanted_video});
  return fmt::format(
      "ffmpeg is not installed, so there are pictures instead of {}; where it is, this makes the movie of them:\n  {}",
      target.wanted_video, command);
}

// Numbered pictures in a folder; the destructor deletes them unless they are kept.
class Pictures {
 public:
  // Pictures for a video go into a folder beside it, where ffmpeg reads them.
  Pictures(const MovieTarget& target, image::Alpha alpha) : target_(target), alpha_(alpha) {
    if (target.kind != MovieTarget::Kind::kVideo) return;
    target_.path = target.path + ".pictures";
    alpha_ = image::Alpha::kNone;
    temporary_ = true;
  }
  ~Pictures() {
    if (kept_) return;
    std::error_code error;
    for (uint64_t n = 0; n < count_; ++n) fs::remove(target_.picture(n), error);
    if (temporary_) fs::remove(target_.path + "/ffmpeg.log", error);
    if (made_) fs::remove(target_.path, error);  // if it is empty
  }
  Status open() {
    std::error_code error;
    made_ = fs::create_directories(target_.path, error);
    if (error) return Error{fmt::format("{}: cannot be made a folder: {}", target_.path, error.message())};
    if (temporary_ && !made_) return Error{fmt::format("{}: is in the way; remove it", target_.path)};
    return ok_status();
  }
  // again: the picture is that of the last call.
  Status add(const image::View& picture, bool again) {
    const std::string path = target_.picture(count_);
    std::error_code error;
    if (!again) {
      if (const Status s = image::write_png(path, picture, alpha_); !s) return s;
    } else if (temporary_) {
      fs::create_hard_link(target_.picture(count_ - 1), path, error);
    } else {
      fs::copy_file(target_.picture(count_ - 1), path, fs::copy_options::overwrite_existing, error);
    }
    if (error) return Error{fmt::format("{}: cannot be written: {}", path, error.message())};
    ++count_;
    return ok_status();
  }
  const std::string& folder() const { return target_.path; }
  void keep() { kept_ = true; }

 private:
  MovieTarget target_;
  image::Alpha alpha_;
  bool temporary_ = false, made_ = false, kept_ = false;
  uint64_t count_ = 0;
};

class Movie {
 public:
  Movie(Screen& screen, const MoviePlan& plan, const tools::ShouldStop& should_stop)
      : screen_(screen), plan_(plan), should_stop_(should_stop) {}

  Result<MovieReport> make(tools::ProgressLine& line) {
    const double fps = plan_.options.fps;
    const double frames = std::floor(screen_.duration_s() * fps) + 1;
    if (!(frames <= kMostFrames))
      return Error{fmt::format("{}: a movie of {:.0f} frames; at most {:.0f}", plan_.target.path, frames, kMostFrames)};
    Pictures pictures(plan_.target, screen_.run().transparent ? image::Alpha::kCoverage : image::Alpha::kNone);
    report_.written = pictures.open();
    if (!report_.written) return std::move(report_);
    const auto count = draw(pictures, uint64_t(frames), line);
    if (!count) return count.error();
    std::string with = "PNG";
    if (report_.written && plan_.target.kind == MovieTarget::Kind::kVideo && !should_stop_()) {
      line.show(fmt::format("ffmpeg makes {}", plan_.target.path));
      auto encoder = encode_video(plan_.target.ffmpeg, pictures.folder(), plan_.target.path, fps, should_stop_);
      if (encoder)
        with = *std::move(encoder);
      else
        report_.written = encoder.error();
    }
    if (should_stop_()) return MovieReport{.interrupted = true};
    if (!report_.written) return std::move(report_);
    if (plan_.target.kind == MovieTarget::Kind::kPictures) pictures.keep();
    describe(*count, with);
    return std::move(report_);
  }

 private:
  // Returns the movie's number of frames. Write errors stand in the report.
  Result<uint64_t> draw(Pictures& pictures, uint64_t frames, tools::ProgressLine& line) {
    for (uint64_t k = 0; k < frames; ++k) {
      if (should_stop_()) return k;
      const double t_s = double(k) / plan_.options.fps;
      const auto shown = screen_.show(t_s);
      if (!shown) return shown.error();
      if (*shown == Screen::Shown::kRecordEnds) {
        if (k == 0) return Error{cut_short(screen_, 0)};
        report_.lines.push_back(cut_short(screen_, t_s));
        return k;
      }
      report_.written = pictures.add(screen_.view(), *shown == Screen::Shown::kSame);
      if (!report_.written) return k;
      line.show("making the movie", double(k + 1) / double(frames));
    }
    return frames;
  }

  void describe(uint64_t frames, const std::string& with) {
    const MovieTarget& target = plan_.target;
    const bool pictures = target.kind == MovieTarget::Kind::kPictures;
    report_.lines.push_back(fmt::format("{}: {} frames of {}x{} ({}), {} a second, {:.2f} s; {} displayed frames of {}",
                                        pictures ? target.pattern() : target.path, frames, screen_.width(),
                                        screen_.height(), with, plan_.options.fps, double(frames) / plan_.options.fps,
                                        screen_.drawn(), screen_.run().frames.size()));
    if (screen_.run().transparent && !pictures)
      report_.lines.push_back("a video has no transparency: the background is black; a folder of pictures has alpha");
    if (target.wanted_video.empty()) return;
    report_.lines.push_back(advice(target, plan_.options.fps));
    report_.instead = true;
  }

  Screen& screen_;
  const MoviePlan& plan_;
  const tools::ShouldStop& should_stop_;
  MovieReport report_;
};

// Arranges the cells so that the sheet is about as high as wide.
std::vector<SheetRow> in_rows(const std::vector<SheetCell>& cells) {
  const image::View& first = cells.front().pictures.front();
  const auto columns =
      std::max(size_t{1}, size_t(std::ceil(std::sqrt(double(cells.size()) * first.height / first.width))));
  std::vector<SheetRow> out;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i % columns == 0) out.emplace_back();
    out.back().cells.push_back(cells[i]);
  }
  return out;
}

Result<MovieReport> make_sheet(Screen& screen, const MoviePlan& plan, tools::ProgressLine& line,
                               const tools::ShouldStop& should_stop) {
  const int count = plan.options.pictures;
  std::vector<SheetCell> cells;
  MovieReport report;
  for (int i = 0; i < count; ++i) {
    if (should_stop()) return MovieReport{.interrupted = true};
    const double t_s = count == 1 ? screen.duration_s() / 2 : screen.duration_s() * i / (count - 1);
    const auto shown = screen.show(t_s);
    if (!shown) return shown.error();
    if (*shown == Screen::Shown::kRecordEnds) {
      if (i == 0) return Error{cut_short(screen, 0)};
      report.lines.push_back(cut_short(screen, t_s));
      break;
    }
    const DisplayedFrame& frame = screen.frame();
    cells.push_back(
        {{small_picture(screen.view(), kSmallWidth)}, {fmt::format("{:.2f} s  frame {}", frame.t_s, frame.number)}});
    line.show("making the contact sheet", double(i + 1) / count);
  }
  const std::string& path = plan.target.path;
  std::error_code error;
  if (const auto folder = fs::path(path).parent_path(); !folder.empty()) fs::create_directories(folder, error);
  report.written =
      image::write_png(path, contact_sheet({fmt::format("{}, {:.1f} s, {} frames", screen.run().scene->name(),
                                                        screen.duration_s(), screen.run().frames.size())},
                                           in_rows(cells)));
  if (report.written) report.lines.push_back(fmt::format("{}: {} frames of the run", path, cells.size()));
  return report;
}

}  // namespace

Result<MoviePlan> plan_movie(const MovieOptions& options, const char* size_flag) {
  const auto size = movie_size(options, size_flag);
  if (!size) return size.error();
  auto target = movie_target(options.file);
  if (!target) return target.error();
  const Container* container = container_of(options.file);
  if (container && container->even_sides && (size->first % 2 || size->second % 2))
    return Error{fmt::format("{} {}: a {} movie has even sides", size_flag, options.size, container->extension)};
  return MoviePlan{options, std::move(*target), size->first, size->second, size_flag};
}

Result<MovieReport> make_movie(const std::string& run_directory, const MoviePlan& plan, tools::ProgressLine& progress,
                               const tools::ShouldStop& should_stop) {
  auto screen = Screen::open(run_directory, plan.width, plan.height, plan.size_flag, plan.options.threads);
  if (!screen) return screen.error();
  auto report = plan.target.kind == MovieTarget::Kind::kSheet ? make_sheet(*screen, plan, progress, should_stop)
                                                              : Movie(*screen, plan, should_stop).make(progress);
  progress.close();
  if (report) report->lines.insert(report->lines.begin(), screen->notes().begin(), screen->notes().end());
  return report;
}

}  // namespace telesplat::launcher
