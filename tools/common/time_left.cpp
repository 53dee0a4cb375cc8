#include "tools/common/time_left.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace telesplat::tools {
namespace {

constexpr double kLeastLeft_s = 5;
// Before that a guess would jump about.
constexpr double kLeastSeen_s = 1, kLeastSeen = 0.02;

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

}  // namespace telesplat::tools
