#include "client/displays/window/panel/launcher_lines.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace telesplat::viewer {

LauncherLines::LauncherLines(int fd) : fd_(fd) {
  if (fd_ >= 0) fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
}

std::vector<std::string> LauncherLines::read() {
  std::vector<std::string> out;
  char buffer[4096];
  while (fd_ >= 0) {
    const ssize_t n = ::read(fd_, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) fd_ = -1;  // the launcher has gone
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

}  // namespace telesplat::viewer
