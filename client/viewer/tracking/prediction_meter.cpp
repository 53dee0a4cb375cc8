#include "client/viewer/tracking/prediction_meter.h"

#include <algorithm>

#include "client/viewer/tracking/head_filter.h"

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

void PredictionMeter::predicted(double made_s, const geometry::Pose& now, double for_s,
                                const geometry::Pose& expected) {
  waiting_.push_back({made_s, for_s, now, expected});
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
}

void PredictionMeter::actual(double t_s, const geometry::Pose& pose) {
  if (begun_ && t_s <= last_s_) return;
  const bool known = begun_ && t_s - last_s_ <= kMostGap_s;
  std::erase_if(waiting_, [&](const Waiting& w) {
    if (w.for_s > t_s) return false;
    if (!known || w.for_s < last_s_) return true;
    const double f = (w.for_s - last_s_) / (t_s - last_s_);
    const glm::dvec3 position = glm::mix(last_.position_room, pose.position_room, f);
    const glm::dquat orientation = glm::slerp(last_.orientation, pose.orientation, f);
    ++sums_.count;
    sums_.horizon_s += w.for_s - w.made_s;
    sums_.error_m += glm::distance(w.expected.position_room, position);
    sums_.error_rad += angle_between(w.expected.orientation, orientation);
    sums_.unpredicted_m += glm::distance(w.now.position_room, position);
    sums_.unpredicted_rad += angle_between(w.now.orientation, orientation);
    return true;
  });
  begun_ = true;
  last_s_ = t_s;
  last_ = pose;
}

PredictionMeter::Figures PredictionMeter::figures() const {
  Figures out = sums_;
  const double n = double(std::max<uint64_t>(1, out.count));
  for (double* sum : {&out.horizon_s, &out.error_m, &out.error_rad, &out.unpredicted_m, &out.unpredicted_rad})
    *sum /= n;
  return out;
}

}  // namespace telesplat::tracking
