#include "client/viewer/record/frame_spool.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "common/core/guarded.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

// A spool file: this header, then colour (u32) and depth (f32) of width x height pixels, then the legend's text.
struct FileHeader {
  char magic[8] = {'T', 'S', 'F', 'R', 'A', 'M', 'E', '4'};
  uint64_t number = 0, epoch = 0;
  double t_s = 0;
  double camera[12] = {};
  int32_t width = 0, height = 0;
  uint32_t use = 0, has_depth = 0;
  int32_t part[4] = {};
  uint32_t eye = 0, unused = 0;
  uint64_t legend_bytes = 0;
};

using FilePtr = std::unique_ptr<FILE, int (*)(FILE*)>;
FilePtr open_file(const std::string& path, const char* mode) { return {std::fopen(path.c_str(), mode), std::fclose}; }

// Returns 0, or errno.
int write_frame(const std::string& directory, const SpooledFrame& f) {
  FileHeader h;
  const auto& c = f.camera;
  const auto& p = c.pose.position_room;
  const auto& q = c.pose.orientation;
  h.number = f.number;
  h.epoch = f.epoch.value;
  h.t_s = f.t_s;
  const double camera[12] = {p.x, p.y, p.z, q.w, q.x, q.y, q.z, c.left, c.right, c.bottom, c.top, c.near_m};
  std::copy(camera, camera + 12, h.camera);
  h.width = c.width;
  h.height = c.height;
  h.use = f.use;
  h.has_depth = !f.view.depth_m.empty();
  h.eye = f.eye;
  const int32_t part[4] = {f.part.width, f.part.height, f.part.x, f.part.y};
  std::copy(part, part + 4, h.part);
  const std::string legend = f.legend ? image::to_text(*f.legend) : "";
  h.legend_bytes = legend.size();
  constexpr const char* kEyes[] = {"", "-left", "-right"};
  const std::string path = fmt::format("{}/{:08d}{}.frame", directory, f.number, kEyes[f.eye]);
  unlink((path + ".part").c_str());
  FilePtr out = open_file(path + ".part", "wbx");  // never follows a link
  if (!out) return errno;
  bool ok = std::fwrite(&h, sizeof h, 1, out.get()) == 1;
  ok = ok && std::fwrite(f.view.colour.data(), 4, f.view.colour.size(), out.get()) == f.view.colour.size();
  if (h.has_depth)  // otherwise there is no array to point to
    ok = ok && std::fwrite(f.view.depth_m.data(), 4, f.view.depth_m.size(), out.get()) == f.view.depth_m.size();
  ok = ok && std::fwrite(legend.data(), 1, legend.size(), out.get()) == legend.size();
  int failed = ok ? 0 : errno;
  if (std::fclose(out.release()) != 0 && ok) failed = errno;
  if (failed == 0 && std::rename((path + ".part").c_str(), path.c_str()) != 0) failed = errno;
  std::error_code error;
  if (failed != 0) fs::remove(path + ".part", error);
  return failed;
}

Status read_legend(FILE* in, const FileHeader& h, SpooledFrame& f) {
  if (h.legend_bytes == 0) return ok_status();
  std::string text(h.legend_bytes, '\0');
  if (std::fread(text.data(), 1, text.size(), in) != text.size()) return Error{"its legend cannot be read"};
  auto legend = image::legend_from_text(text);
  if (!legend) return legend.error();
  f.legend = std::make_shared<image::Legend>(std::move(*legend));
  f.part = {h.part[0], h.part[1], h.part[2], h.part[3]};
  for (const int side : {f.part.width, f.part.height})
    if (side < 1 || side > 64 * geometry::kMaxImageSide) return Error{fmt::format("a display of {} pixels", side)};
  return ok_status();
}

}  // namespace

Result<std::unique_ptr<FrameSpool>> FrameSpool::open(const std::string& directory, size_t max_waiting) {
  if (const auto error = make_private_folder(directory))
    return Error{fmt::format("{}: cannot be made a folder for frames: {}", directory, error.message())};
  std::unique_ptr<FrameSpool> out(new FrameSpool);
  out->directory_ = directory;
  out->max_waiting_ = max_waiting;
  out->thread_ = std::thread([spool = out.get()] { spool->write_loop(); });
  return out;
}

FrameSpool::~FrameSpool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

image::View FrameSpool::exchange(SpooledFrame frame) {
  const int width = frame.view.width, height = frame.view.height;
  image::View out;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= max_waiting_) {
      ++dropped_;
      return std::move(frame.view);
    }
    const bool depth = !frame.view.depth_m.empty();
    waiting_.push_back(std::move(frame));
    if (!free_.empty()) {
      out = std::move(free_.back());
      free_.pop_back();
    }
    out.width = width;
    out.height = height;
    out.colour.resize(size_t(width) * height);
    out.depth_m.resize(depth ? size_t(width) * height : 0);
  }
  changed_.notify_all();
  return out;
}

void FrameSpool::write_loop() {
  net::lower_thread_priority(10);  // the display comes first
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    SpooledFrame frame = std::move(waiting_.front());
    waiting_.pop_front();
    writing_ = true;
    lock.unlock();
    int error = 0;
    const Status wrote = guarded("writing a frame", [&] { error = write_frame(directory_, frame); });
    if (!wrote) error = ENOMEM;
    if (error != 0) on_failure(error);
    lock.lock();
    writing_ = false;
    free_.push_back(std::move(frame.view));
    changed_.notify_all();
  }
}

// Later frames may succeed: the disk may have room again.
void FrameSpool::on_failure(int error) {
  if (failed_++ > 0) return;
  error_ = error;
  log::error("{}: frames cannot be written: {}; the session goes on without them", directory_, std::strerror(error));
}

void FrameSpool::flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_.empty() && !writing_; });
}

std::vector<std::string> spooled_frames(const std::string& directory) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error))
    if (entry.path().extension() == ".frame") out.push_back(entry.path().string());
  std::sort(out.begin(), out.end());
  return out;
}

Result<SpooledFrame> read_spooled_frame(const std::string& path) {
  std::error_code error;
  const FilePtr in = fs::is_regular_file(path, error) ? open_file(path, "rb") : FilePtr{nullptr, std::fclose};
  FileHeader h;
  const bool read = in && std::fread(&h, sizeof h, 1, in.get()) == 1;
  // The last letter of the magic is the version.
  if (!read || std::memcmp(h.magic, FileHeader{}.magic, 7) != 0)
    return Error{fmt::format("{}: is not a recorded frame", path)};
  if (h.magic[7] != FileHeader{}.magic[7])
    return Error{fmt::format("{}: is a recorded frame of version {:?} instead of {:?}", path, h.magic[7],
                             FileHeader{}.magic[7])};
  if (h.eye > 2) return Error{fmt::format("{}: is of eye {}, limits are 0 and 2", path, h.eye)};
  SpooledFrame f{h.number, h.t_s, h.use, {}, {}, {h.epoch}, {}, {}, h.eye};
  const double* c = h.camera;
  f.camera = {
      {{c[0], c[1], c[2]}, glm::dquat(c[3], c[4], c[5], c[6])}, c[7], c[8], c[9], c[10], c[11], h.width, h.height};
  if (const Status s = geometry::validate(f.camera); !s) return Error{fmt::format("{}: {}", path, s.error().text)};
  const size_t pixels = size_t(h.width) * size_t(h.height);
  if (h.legend_bytes > image::kMaxLegendText ||
      fs::file_size(path, error) != sizeof h + pixels * (h.has_depth ? 8 : 4) + h.legend_bytes)
    return Error{fmt::format("{}: its size does not fit {}x{} pixels", path, h.width, h.height)};
  f.view = {h.width, h.height, std::vector<uint32_t>(pixels), std::vector<float>(h.has_depth ? pixels : 0)};
  if (std::fread(f.view.colour.data(), 4, pixels, in.get()) != pixels ||
      std::fread(f.view.depth_m.data(), 4, f.view.depth_m.size(), in.get()) != f.view.depth_m.size())
    return Error{fmt::format("{}: cannot be read", path)};
  if (const Status s = read_legend(in.get(), h, f); !s) return Error{fmt::format("{}: {}", path, s.error().text)};
  return f;
}

Status develop_frames(const std::string& spool_directory, const std::string& picture_directory,
                      const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& go_on) {
  std::error_code error = make_private_folder(picture_directory);
  const auto paths = spooled_frames(spool_directory);
  for (size_t i = 0; i < paths.size(); ++i) {
    if (go_on && !go_on()) break;
    auto frame = read_spooled_frame(paths[i]);
    if (!frame) return frame.error();
    const auto alpha = frame->use & kTransparent ? image::Alpha::kCoverage : image::Alpha::kNone;
    const std::string base = fmt::format("{}/frame-{:06d}", picture_directory, frame->number);
    if ((frame->use & kExr) && !frame->view.depth_m.empty())
      if (const Status s = image::write_exr(base + ".exr", frame->view, alpha); !s) return s;
    if (frame->legend) image::draw_legend(frame->view, *frame->legend, frame->part);
    if (frame->use & kPicture)
      if (const Status s = image::write_png(base + ".png", frame->view, alpha); !s) return s;
    if (!(frame->use & kVerify)) fs::remove(paths[i], error);
    if (progress) progress(i + 1, paths.size());
  }
  return ok_status();
}

}  // namespace telesplat::viewer
