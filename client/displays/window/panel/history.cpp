#include "client/displays/window/panel/history.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace telesplat::viewer {

constexpr double kMostValue = 1e30;  // what a plot is drawn with has float coordinates

void History::add(double t_s, double value) {
  if (!std::isfinite(t_s) || !(std::abs(value) < kMostValue)) return;
  if (!samples_.empty() && t_s < samples_.back().t_s) samples_.clear();
  samples_.push_back({t_s, value});
  // One that is older stays: the plot's left edge goes on from it.
  while (samples_.size() > 2 && (samples_[1].t_s < t_s - span_s_ || samples_.size() > kMost)) samples_.pop_front();
}

std::vector<float> History::columns(double now_s, size_t count) const {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> out(count, kNone);
  const double from_s = now_s - span_s_;
  float before = kNone;  // what the first column goes on from
  for (const auto& s : samples_) {
    if (s.t_s < from_s) {
      before = float(s.value);
      continue;
    }
    if (s.t_s > now_s) break;
    const auto column = std::min(count - 1, size_t((s.t_s - from_s) / span_s_ * double(count)));
    out[column] = std::isnan(out[column]) ? float(s.value) : std::max(out[column], float(s.value));
  }
  for (float& value : out) before = value = std::isnan(value) ? before : value;
  return out;
}

}  // namespace telesplat::viewer
