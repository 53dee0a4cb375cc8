#include "tools/common/progress_line.h"

#include <unistd.h>

#include <cstdio>

#include "common/core/clock.h"

namespace telesplat::tools {
namespace {

constexpr double kRewriteEvery_s = 0.1, kLineEvery_s = 5;

}  // namespace

ProgressLine::ProgressLine(double first_after_s)
    : terminal_(isatty(STDERR_FILENO) != 0),
      begin_s_(monotonic_s() + first_after_s),
      last_s_(terminal_ ? 0 : monotonic_s()) {}

void ProgressLine::show(const std::string& text) {
  const std::lock_guard lock(mutex_);
  const double now = monotonic_s();
  if (now < begin_s_ || now - last_s_ < (terminal_ ? kRewriteEvery_s : kLineEvery_s)) return;
  last_s_ = now;
  std::fprintf(stderr, terminal_ ? "\r\033[K%s" : "%s\n", text.c_str());
  std::fflush(stderr);
  open_ = terminal_;
}

void ProgressLine::show(const char* what, double fraction) {
  std::string text;
  {
    const std::lock_guard lock(mutex_);
    text = time_left_.text(what, fraction, monotonic_s());
  }
  show(text);
}

void ProgressLine::line(const std::string& text) {
  close();
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, "%s\n", text.c_str());
}

void ProgressLine::close() {
  const std::lock_guard lock(mutex_);
  if (open_) std::fprintf(stderr, "\n");
  open_ = false;
}

}  // namespace telesplat::tools
