#include "client/viewer/tracking/pose_clock.h"

#include <algorithm>

namespace telesplat::tracking {

double PoseClock::local_s(double t_s, double arrived_s) {
  const double difference = arrived_s - t_s;
  if (!this_ || arrived_s - window_began_s_ > kWindow_s || arrived_s < window_began_s_) {
    before_ = arrived_s - window_began_s_ > 2 * kWindow_s ? std::nullopt : this_;
    this_ = difference;
    window_began_s_ = arrived_s;
  }
  this_ = std::min(*this_, difference);
  return t_s + std::min(*this_, before_.value_or(*this_));
}

}  // namespace telesplat::tracking
