#include "tools/common/progress_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/clock.h"

namespace telesplat::tools {
namespace {

constexpr double kLeastLeft_s = 5;
// Before that much time and work a guess would jump about.
constexpr double kLeastSeen_s = 1, kLeastSeen = 0.02;

constexpr double kRewriteEvery_s = 0.1, kLineEvery_s = 5;

}  // namespace

std::string TimeLeft::text(const std::string& stage, double fraction, double now_s) {
  fraction = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0;
  const auto [begin, is_new] = begins_.try_emplace(stage, Begin{now_s, fraction, fraction});
  if (fraction < begin->second.last) begin->second = {now_s, fraction, fraction};  // it began again
  begin->second.last = fraction;
  std::string out = fraction > 0 ? fmt::format("{} {:.0f} %", stage, std::floor(100 * fraction)) : stage;
  const double seen_s = now_s - begin->second.at_s, seen = fraction - begin->second.fraction;
  if (seen_s < kLeastSeen_s || seen < kLeastSeen) return out;
  const double left_s = seen_s * (1 - fraction) / seen;
  if (left_s > kLeastLeft_s) out += fmt::format(", {} left", duration_text(left_s));
  return out;
}

std::string duration_text(double seconds) {
  const auto s = int64_t(std::llround(seconds));
  if (s < 90) return fmt::format("{} s", s);
  const int64_t minutes = (s + 30) / 60;
  if (minutes < 60) return fmt::format("{} min", minutes);
  return fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

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
