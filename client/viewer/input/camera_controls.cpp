#include "client/viewer/input/camera_controls.h"

#include <algorithm>
#include <cmath>

namespace telesplat::viewer {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLag_s = 0.05;  // of the camera behind its goal: three frames
constexpr double kMaxStep_s = 0.25;
constexpr double kOrbit_rad = kPi, kLook_rad = 1.5;  // a window height
constexpr double kDollyStep = 0.9, kSpeedStep = 1.2, kFast = 4;
constexpr double kMaxDrag = 4, kMaxWheel = 50;  // window heights, steps: at once

// Within +-limit; what is not finite becomes nothing.
double sane(double v, double limit) { return std::isfinite(v) ? std::clamp(v, -limit, limit) : 0.0; }

}  // namespace

CameraControls::CameraControls(const geometry::Pose& home) : home_(home) {
  now_ = goal_ = state_at(home_, distance_of_interest(home_));
}

glm::dquat CameraControls::rotation(const State& s) {
  return glm::angleAxis(s.yaw, glm::dvec3(0, 1, 0)) * glm::angleAxis(s.pitch, glm::dvec3(1, 0, 0)) *
         glm::angleAxis(s.roll, glm::dvec3(0, 0, 1));
}

geometry::Pose CameraControls::pose_of(const State& s) {
  const glm::dquat q = glm::normalize(rotation(s));
  return {s.anchor + q * glm::dvec3(0, 0, s.distance), q};
}

CameraControls::State CameraControls::state_at(const geometry::Pose& pose, double distance) {
  const glm::dvec3 forward = pose.orientation * glm::dvec3(0, 0, -1);
  State s;
  s.pitch = std::asin(std::clamp(forward.y, -1.0, 1.0));
  // Looking straight up or down, the direction in which the head's top points tells the heading.
  const glm::dvec3 level =
      std::abs(forward.y) < 0.9999 ? forward : -forward.y * (pose.orientation * glm::dvec3(0, 1, 0));
  s.yaw = std::atan2(-level.x, -level.z);
  const glm::dquat tilt = glm::conjugate(rotation(s)) * pose.orientation;
  s.roll = std::remainder(2 * std::atan2(tilt.z, tilt.w), 2 * kPi);
  s.distance = distance;
  s.anchor = pose.position_room + forward * distance;
  return s;
}

double CameraControls::distance_of_interest(const geometry::Pose& pose) const {
  const glm::dvec3 forward = pose.orientation * glm::dvec3(0, 0, -1), to_centre = centre_ - pose.position_room;
  double ahead = glm::dot(to_centre, forward);
  // Who looks at the data set's vertical axis turns about that.
  const double level = forward.x * forward.x + forward.z * forward.z;
  if (level > 1e-6) {
    const double at_axis = (to_centre.x * forward.x + to_centre.z * forward.z) / level;
    const glm::dvec3 miss = forward * at_axis - to_centre;
    if (at_axis > 0 && std::hypot(miss.x, miss.z) < 1e-3 * extent_m_ && std::abs(miss.y) < 0.5 * extent_m_)
      ahead = at_axis;
  }
  return std::clamp(ahead, 0.25 * extent_m_, farthest_m_);
}

void CameraControls::set_scene(const geometry::Box& box, const geometry::Pose& home) {
  const glm::dvec3 size = glm::dvec3(box.hi) - glm::dvec3(box.lo), centre = glm::dvec3(box.lo) + size * 0.5;
  const double extent_m = std::max({size.x, size.y, size.z});
  if (!(extent_m > 0) || !(glm::length(centre) <= Limits::kLargest_m) || !std::isfinite(extent_m)) return;
  centre_ = centre;
  extent_m_ = std::clamp(extent_m, Limits::kSmallest_m, Limits::kLargest_m);
  home_ = home;
  const double home_m = glm::distance(home.position_room, centre);
  farthest_m_ = std::max(Limits::kFarthest * extent_m_, 2 * home_m);
  flight_m_ = std::max(Limits::kFlight * extent_m_, 2 * home_m);
  const State home_state = state_at(home_, distance_of_interest(home_));
  pivot_m_ = std::max(Limits::kPivot * extent_m_, glm::distance(home_state.anchor, centre_));
  if (touched_)
    clamp_goal();
  else
    now_ = goal_ = home_state;  // as it is: it may look straight up
}

void CameraControls::orbit(double dx, double dy) {
  touched_ = true;
  const double turn = flying_ ? kLook_rad : kOrbit_rad;
  goal_.yaw -= turn * sane(dx, kMaxDrag);
  goal_.pitch -= turn * sane(dy, kMaxDrag);
  clamp_goal();
}

void CameraControls::pan(double dx, double dy, double height_tangent) {
  if (flying_) return;
  touched_ = true;
  const double metres = sane(height_tangent, 100) * goal_.distance;
  goal_.anchor += rotation(goal_) * glm::dvec3(-sane(dx, kMaxDrag) * metres, sane(dy, kMaxDrag) * metres, 0);
  clamp_goal();
}

void CameraControls::wheel(double steps) {
  touched_ = true;
  steps = sane(steps, kMaxWheel);
  if (flying_)
    speed_ = std::clamp(speed_ * std::pow(kSpeedStep, steps), Limits::kSlowest, Limits::kFastest);
  else
    goal_.distance *= std::pow(kDollyStep, steps);
  clamp_goal();
}

void CameraControls::set_flying(bool flying) {
  if (flying == flying_) return;
  touched_ = true;
  flying_ = flying;
  // Goal and camera keep their poses; only what they turn about moves.
  const auto move_anchor = [&](State& s, double distance) {
    s.anchor += rotation(s) * glm::dvec3(0, 0, s.distance - distance);
    s.distance = distance;
  };
  const double distance = flying ? 0 : distance_of_interest(pose_of(goal_));
  for (State* s : {&now_, &goal_}) move_anchor(*s, distance);
  clamp_goal();
}

void CameraControls::reset() {
  const geometry::Pose from = pose();
  flying_ = false;
  flight_ = {};
  goal_ = state_at(home_, distance_of_interest(home_));
  now_ = state_at(from, goal_.distance);
  goal_.yaw = now_.yaw + std::remainder(goal_.yaw - now_.yaw, 2 * kPi);
}

void CameraControls::take_over(const geometry::Pose& pose) {
  touched_ = true;
  now_ = state_at(pose, flying_ ? 0 : distance_of_interest(pose));
  goal_ = now_;
  goal_.roll = 0;
  clamp_goal();
}

void CameraControls::clamp_goal() {
  goal_.pitch = std::clamp(goal_.pitch, -Limits::kPitch_rad, Limits::kPitch_rad);
  const double reach = flying_ ? flight_m_ : pivot_m_;
  goal_.anchor = glm::clamp(goal_.anchor, centre_ - reach, centre_ + reach);
  if (!flying_) goal_.distance = std::clamp(goal_.distance, Limits::kNearest * extent_m_, farthest_m_);
}

glm::dvec3 CameraControls::flight_velocity() const {
  if (!flying_) return glm::dvec3(0);
  const glm::dvec3 wish = rotation(goal_) * glm::dvec3(sane(flight_.right, 1), 0, -sane(flight_.forward, 1)) +
                          glm::dvec3(0, sane(flight_.up, 1), 0);
  const double length = glm::length(wish);
  return length < 1e-9 ? glm::dvec3(0)
                       : wish / std::max(1.0, length) * (speed_ * extent_m_ * (flight_.fast ? kFast : 1));
}

geometry::Pose CameraControls::advance(double dt_s) {
  const double dt = std::isfinite(dt_s) ? std::clamp(dt_s, 0.0, kMaxStep_s) : 0.0;
  if (dt == 0) return pose();
  // First-order lag behind a goal that moves at a constant rate, solved exactly: the same path at any frame rate.
  const glm::dvec3 before = goal_.anchor;
  goal_.anchor += flight_velocity() * dt;
  if (touched_) clamp_goal();
  const double keep = std::exp(-dt / kLag_s);
  const glm::dvec3 trail = (goal_.anchor - before) / dt * kLag_s;  // how far a camera trails a goal of this velocity
  const bool moving = flying_ && trail != glm::dvec3(0);
  now_.anchor = moving ? goal_.anchor - trail + (now_.anchor - before + trail) * keep
                       : goal_.anchor + (now_.anchor - goal_.anchor) * keep;
  const auto follow = [&](double& v, double goal) { v = goal + (v - goal) * keep; };
  follow(now_.yaw, goal_.yaw);
  follow(now_.pitch, goal_.pitch);
  follow(now_.roll, goal_.roll);
  // Distances by ratio, so that coming near is as smooth as going away.
  if (!flying_) now_.distance = goal_.distance * std::pow(now_.distance / goal_.distance, keep);
  return pose();
}

}  // namespace telesplat::viewer
