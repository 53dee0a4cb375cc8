#include "tests/support/xr/pacing.h"

#include <algorithm>
#include <cmath>

namespace telesplat::xr_test {

double Pacing::refresh_from(double t_s) const {
  return origin_s_ + std::ceil((t_s - origin_s_) / period_s_ - 1e-6) * period_s_;
}

Pacing::Frame Pacing::next(double now_s) {
  last_s_ = std::max(refresh_from(last_s_ + 0.5 * period_s_), refresh_from(now_s + 0.5 * period_s_));
  return {last_s_, std::max(now_s, last_s_ - period_s_)};
}

double Pacing::shown_s(double display_s, double submitted_s) const {
  return submitted_s <= display_s ? display_s : refresh_from(submitted_s);
}

}  // namespace telesplat::xr_test
