#include "client/viewer/tracking/pose_predictor.h"

#include <algorithm>

#include "client/viewer/tracking/head_filter.h"

namespace telesplat::tracking {
namespace {

constexpr double kVelocityWindow_s = 0.15;
// A jump is both farther than predictions ever reach, and faster than heads are.
constexpr double kFastest_m_s = 8, kFastest_rad_s = 40;
constexpr double kLongestGap_s = 0.5;  // after a longer gap the head's movement counts as unknown

}  // namespace

std::optional<Prediction> prediction_named(std::string_view name) {
  for (size_t i = 0; i < kPredictionNames.size(); ++i)
    if (name == kPredictionNames[i]) return Prediction(i);
  return std::nullopt;
}

const char* name_of(Prediction prediction) { return kPredictionNames[size_t(prediction)]; }

void PosePredictor::forget() {
  samples_.clear();
  filter_.forget();
}

void PosePredictor::add(double t_s, const geometry::Pose& pose) {
  if (const auto last = newest()) {
    const double dt_s = t_s - last->t_s;
    if (!(dt_s > 0)) return;
    const double move = glm::distance(pose.position_room, last->pose.position_room);
    const double turn = angle_between(pose.orientation, last->pose.orientation);
    if (dt_s > kLongestGap_s || (move > kMaxMove_m && move > kFastest_m_s * dt_s) ||
        (turn > kMaxTurn_rad && turn > kFastest_rad_s * dt_s))
      forget();
  }
  samples_.push_back({t_s, pose});
  while (samples_.size() > 2 && samples_[1].t_s < t_s - kVelocityWindow_s) samples_.pop_front();
  if (method_ == Prediction::kKalman) filter_.add(t_s, pose);
}

PosePredictor::Velocity PosePredictor::velocity() const {
  if (samples_.size() < 2) return {};
  if (method_ == Prediction::kKalman) return {filter_.velocity(), filter_.turn()};
  const Sample &a = samples_.front(), &b = samples_.back();
  const double dt = b.t_s - a.t_s;
  if (dt < 1e-3) return {};
  return {(b.pose.position_room - a.pose.position_room) / dt,
          rotation_vector(b.pose.orientation * glm::conjugate(a.pose.orientation)) / dt};
}

double PosePredictor::speed_m_s() const { return glm::length(velocity().linear); }
double PosePredictor::turn_rad_s() const { return glm::length(velocity().angular); }

geometry::Pose PosePredictor::carried(const geometry::Pose& pose, double dt_s) const {
  const Velocity v = velocity();
  return {pose.position_room + clamp_length(v.linear * dt_s, kMaxMove_m),
          glm::normalize(rotation(clamp_length(v.angular * dt_s, kMaxTurn_rad)) * pose.orientation)};
}

geometry::Pose PosePredictor::unbounded(double t_s) const {
  const Sample& last = samples_.back();
  if (method_ == Prediction::kNone || samples_.size() < 2) return last.pose;
  if (method_ == Prediction::kKalman) return filter_.at(t_s);
  return carried(last.pose, std::max(0.0, t_s - last.t_s));
}

geometry::Pose PosePredictor::predict(double t_s) const {
  if (samples_.empty()) return {};
  const geometry::Pose& last = samples_.back().pose;
  const geometry::Pose there = unbounded(t_s);
  if (method_ != Prediction::kKalman) return there;
  const glm::dvec3 turn = rotation_vector(there.orientation * glm::conjugate(last.orientation));
  return {last.position_room + clamp_length(there.position_room - last.position_room, kMaxMove_m),
          glm::normalize(rotation(clamp_length(turn, kMaxTurn_rad)) * last.orientation)};
}

}  // namespace telesplat::tracking
