#include "client/displays/window/opening.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
#include <filesystem>
#include <utility>

namespace telesplat::viewer {
namespace {

constexpr uintmax_t kMostDropped_bytes = 64'000'000;

// Checks a file that the display's thread reads as a whole: it must be a regular file of at most kMostDropped_bytes.
Status readable(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return Error{path + ": is no regular file"};
  const uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error || bytes > kMostDropped_bytes)
    return Error{fmt::format("{}: has {:.0f} MB, at most {:.0f} are read here", path, double(bytes) / 1e6,
                             double(kMostDropped_bytes) / 1e6)};
  return ok_status();
}

}  // namespace

LauncherLines::LauncherLines(int fd) : fd_(fd) {
  if (fd_ >= 0) fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
}

std::vector<std::string> LauncherLines::read() {
  std::vector<std::string> out;
  char buffer[4096];
  while (fd_ >= 0) {
    const ssize_t n = ::read(fd_, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) fd_ = -1;  // the launcher has ended
    if (n <= 0) break;
    for (ssize_t i = 0; i < n; ++i) {
      if (buffer[i] == '\n')
        out.push_back(std::exchange(part_, {}));
      else if (part_.size() < kLongest)
        part_ += buffer[i];
    }
  }
  return out;
}

void Opening::take_launcher_lines(double now_s, bool has_scene, bool seen) {
  for (const std::string& line : launcher_.read()) {
    if (line == "progress") panel_.on_progress({});
    if (line.starts_with("progress ")) panel_.on_progress(line.substr(9));
    if (!line.starts_with("problem ")) continue;
    panel_.tell(now_s, line.substr(8), true);
    if (!seen) interaction_.show_dialog(true);
  }
  interaction_.open().allow(bool(ask_), has_scene);
  if (interaction_.take(Wish::kOpen)) open("");
  if (interaction_.open().dialog != view_.shown) view_ = {.shown = interaction_.open().dialog};
}

void Opening::open(const std::string& path) {
  if (!ask_)
    return tell_("this window shows somebody else's session: telesplat view FILE opens a data set in one of its own");
  tell_("opening " + path);
  ask_(path);
}

// The name's ending decides what it is: a path of the camera, a transfer function, else a data set.
void Opening::take_dropped(Window& window) {
  const auto dropped = window.take_dropped();
  if (dropped.empty()) return;
  const std::string& path = dropped.front();
  if (path.ends_with(".csv")) return play_file(path);
  if (path.ends_with(".json") && scene_.volume()) return use_transfer_file(path);
  open(path);
}

void Opening::play_file(const std::string& path) {
  if (const Status s = readable(path); !s) return tell_(s.error().text);
  auto read = geometry::Trajectory::read_csv(path);
  if (!read) return tell_(read.error().text);
  interaction_.play(std::move(*read));
  tell_("playing " + path + "; T takes the camera");
}

void Opening::use_transfer_file(const std::string& path) {
  if (const Status s = readable(path); !s) return tell_(s.error().text);
  auto read = volume::resolve_transfer(path, scene_.volume()->range);
  if (!read) return tell_(read.error().text);
  panel_.order({"tf", {{"transfer", volume::to_text(*read)}}, {}});
}

void Opening::build(bool has_scene) {
  show_open(view_, has_scene, [this](const std::string& path) { open(path); });
  interaction_.show_dialog(view_.shown);
}

}  // namespace telesplat::viewer
