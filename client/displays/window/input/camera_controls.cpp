#include "client/displays/window/input/camera_controls.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLag_s = 0.05;  // lag of the camera behind its goal: three frames
constexpr double kMaxStep_s = 0.25;
constexpr double kOrbit_rad = kPi, kLook_rad = 1.5;  // turn for a window height
constexpr double kDollySteps = 30;                   // steps for a window height
constexpr double kDollyStep = 0.9, kSpeedStep = 1.2, kFast = 4;
constexpr double kMaxDrag = 4, kMaxWheel = 50;  // limits of one input: window heights, steps

// Limits v to +-limit; a value that is not finite becomes 0.
double sane(double v, double limit) { return std::isfinite(v) ? within(v, -limit, limit) : 0.0; }

}  // namespace

CameraControls::CameraControls(const geometry::Pose& home) : home_(home) { now_ = goal_ = home_view(); }

CameraControls::View CameraControls::home_view() const {
  return view_at(home_, distance_of_interest(home_, home_middle_x_), home_middle_x_);
}

glm::dquat CameraControls::rotation(const View& s) {
  return glm::angleAxis(s.yaw, glm::dvec3(0, 1, 0)) * glm::angleAxis(s.pitch, glm::dvec3(1, 0, 0)) *
         glm::angleAxis(s.roll, glm::dvec3(0, 0, 1));
}

geometry::Pose CameraControls::pose_of(const View& s) {
  const glm::dquat q = glm::normalize(rotation(s));
  return {s.anchor + q * glm::dvec3(-s.middle_x, 0, 1) * s.distance, q};
}

CameraControls::View CameraControls::view_at(const geometry::Pose& pose, double distance, double middle_x) {
  const glm::dvec3 forward = pose.orientation * glm::dvec3(0, 0, -1);
  View s;
  s.pitch = std::asin(within(forward.y, -1.0, 1.0));
  // If the camera looks straight up or down, the direction of the head's top gives the heading.
  const glm::dvec3 level =
      std::abs(forward.y) < 0.9999 ? forward : -forward.y * (pose.orientation * glm::dvec3(0, 1, 0));
  s.yaw = std::atan2(-level.x, -level.z);
  const glm::dquat tilt = glm::conjugate(rotation(s)) * pose.orientation;
  s.roll = std::remainder(2 * std::atan2(tilt.z, tilt.w), 2 * kPi);
  s.distance = distance;
  s.middle_x = middle_x;
  s.anchor = pose.position_room + pose.orientation * glm::dvec3(middle_x, 0, -1) * distance;
  return s;
}

// Distances are depths along the ray through middle_x.
std::optional<double> CameraControls::distance_to_axis(const geometry::Pose& pose, double middle_x) const {
  const glm::dvec3 to_centre = centre_ - pose.position_room, forward = pose.orientation * glm::dvec3(middle_x, 0, -1);
  const double level = forward.x * forward.x + forward.z * forward.z;
  if (level <= 1e-6) return std::nullopt;
  const double at_axis = (to_centre.x * forward.x + to_centre.z * forward.z) / level;
  const glm::dvec3 miss = forward * at_axis - to_centre;
  const bool meets = at_axis > 0 && std::hypot(miss.x, miss.z) < 1e-3 * extent_m_ && std::abs(miss.y) < 0.5 * extent_m_;
  return meets ? std::optional(at_axis) : std::nullopt;
}

double CameraControls::distance_of_interest(const geometry::Pose& pose, double middle_x) const {
  const double ahead = glm::dot(centre_ - pose.position_room, pose.orientation * glm::dvec3(0, 0, -1));
  return within(distance_to_axis(pose, middle_x).value_or(ahead), 0.25 * extent_m_, farthest_m_);
}

// Returns the tangent at which the pose shows the data set's vertical axis.
double CameraControls::middle_of(const geometry::Pose& pose) const {
  return !distance_to_axis(pose, home_middle_x_) && distance_to_axis(pose, 0) ? 0 : home_middle_x_;
}

void CameraControls::set_scene(const geometry::Box& box, const geometry::Pose& home, double middle_x) {
  const glm::dvec3 size = glm::dvec3(box.hi) - glm::dvec3(box.lo), centre = glm::dvec3(box.lo) + size * 0.5;
  const double extent_m = std::max({size.x, size.y, size.z});
  if (!(extent_m > 0) || !(glm::length(centre) <= Limits::kLargest_m) || !std::isfinite(extent_m)) return;
  const struct {
    glm::dvec3 centre;
    double extent_m;
  } before{centre_, extent_m_};
  centre_ = centre;
  extent_m_ = within(extent_m, Limits::kSmallest_m, Limits::kLargest_m);
  home_ = home;
  home_middle_x_ = middle_x;
  const double home_m = glm::distance(home.position_room, centre);
  farthest_m_ = std::max(Limits::kFarthest * extent_m_, 2 * home_m);
  flight_m_ = std::max(Limits::kFlight * extent_m_, 2 * home_m);
  const View to = home_view();
  pivot_m_ = std::max(Limits::kPivot * extent_m_, glm::distance(to.anchor, centre_));
  if (touched_) return clamp_goal();
  // The home pose is used as it is, even beyond the limits. A camera on its way there does not jump.
  const bool another = !std::exchange(has_scene_, true) || centre != before.centre || extent_m_ != before.extent_m;
  if (another && glm::distance(pose_of(now_).position_room, pose_of(goal_).position_room) < 1e-3 * extent_m_)
    now_ = goal_ = to;
  else
    reset();
}

void CameraControls::orbit(double dx, double dy) {
  touched_ = true;
  const double turn = flying_ ? kLook_rad : kOrbit_rad, sine = std::sin(goal_.roll), cosine = std::cos(goal_.roll);
  dx = sane(dx, kMaxDrag), dy = sane(dy, kMaxDrag);
  goal_.yaw -= turn * (cosine * dx + sine * dy);
  goal_.pitch -= turn * (cosine * dy - sine * dx);
  clamp_goal();
}

void CameraControls::dolly(double dy) {
  if (!flying_) wheel(-kDollySteps * sane(dy, 1));
}

void CameraControls::roll(double dx) {
  touched_ = true;
  goal_.roll = std::remainder(goal_.roll + kPi * sane(dx, kMaxDrag), 2 * kPi);
  now_.roll = goal_.roll + std::remainder(now_.roll - goal_.roll, 2 * kPi);
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
    speed_ = within(speed_ * std::pow(kSpeedStep, steps), Limits::kSlowest, Limits::kFastest);
  else
    goal_.distance *= std::pow(kDollyStep, steps);
  clamp_goal();
}

void CameraControls::set_flying(bool flying) {
  if (flying == flying_) return;
  touched_ = true;
  flying_ = flying;
  // Goal and camera keep their poses; only their anchors move.
  const auto move_anchor = [&](View& s, double distance) {
    s.anchor += rotation(s) * glm::dvec3(-s.middle_x, 0, 1) * (s.distance - distance);
    s.distance = distance;
  };
  const double distance = flying ? 0 : distance_of_interest(pose_of(goal_), goal_.middle_x);
  for (View* s : {&now_, &goal_}) move_anchor(*s, distance);
  clamp_goal();
}

void CameraControls::reset() {
  travel(home_view());
  touched_ = false;
}

CameraControls::View CameraControls::view() const {
  if (!flying_) return goal_;
  const geometry::Pose from = pose_of(goal_);
  return view_at(from, distance_of_interest(from, goal_.middle_x), goal_.middle_x);
}

void CameraControls::travel(const geometry::Pose& pose) {
  const double middle_x = middle_of(pose);
  travel(view_at(pose, distance_of_interest(pose, middle_x), middle_x));
  clamp_goal();
}

void CameraControls::travel(const View& view) {
  const geometry::Pose from = pose();
  touched_ = true;
  flying_ = false;
  flight_ = {};
  goal_ = view;
  now_ = view_at(from, goal_.distance, goal_.middle_x);
  for (double View::*angle : {&View::yaw, &View::roll})
    goal_.*angle = now_.*angle + std::remainder(goal_.*angle - now_.*angle, 2 * kPi);
}

void CameraControls::centre_on(const glm::dvec3& place) {
  if (!(glm::length(place - centre_) <= Limits::kLargest_m)) return;
  View to = goal_;
  const glm::dvec3 ahead = rotation(to) * glm::dvec3(0, 0, -1);
  to.distance = std::max(glm::dot(place - pose_of(goal_).position_room, ahead), Limits::kNearest * extent_m_);
  to.anchor = place;
  travel(to);
  clamp_goal();
}

void CameraControls::take_over(const geometry::Pose& pose, bool tilted) {
  touched_ = true;
  const double middle_x = middle_of(pose);
  now_ = view_at(pose, flying_ ? 0 : distance_of_interest(pose, middle_x), middle_x);
  goal_ = now_;
  if (!tilted) goal_.roll = 0;
  clamp_goal();
}

void CameraControls::clamp_goal() {
  goal_.pitch = within(goal_.pitch, -Limits::kPitch_rad, Limits::kPitch_rad);
  const double reach = flying_ ? flight_m_ : pivot_m_;
  goal_.anchor = glm::clamp(goal_.anchor, centre_ - reach, centre_ + reach);
  if (!flying_) goal_.distance = within(goal_.distance, Limits::kNearest * extent_m_, farthest_m_);
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
  const double dt = std::isfinite(dt_s) ? within(dt_s, 0.0, kMaxStep_s) : 0.0;
  if (dt == 0) return pose();
  // First-order lag behind a goal that moves at a constant rate, solved exactly: the same path at any frame rate.
  const glm::dvec3 before = goal_.anchor;
  goal_.anchor += flight_velocity() * dt;
  if (touched_) clamp_goal();
  const double keep = std::exp(-dt / kLag_s);
  const glm::dvec3 trail = (goal_.anchor - before) / dt * kLag_s;  // a camera's distance behind a goal of this velocity
  const bool moving = flying_ && trail != glm::dvec3(0);
  now_.anchor = moving ? goal_.anchor - trail + (now_.anchor - before + trail) * keep
                       : goal_.anchor + (now_.anchor - goal_.anchor) * keep;
  const auto follow = [&](double& v, double goal) { v = goal + (v - goal) * keep; };
  follow(now_.yaw, goal_.yaw);
  follow(now_.pitch, goal_.pitch);
  follow(now_.roll, goal_.roll);
  follow(now_.middle_x, goal_.middle_x);
  // Distances change by ratio, so that approach is as smooth as retreat.
  if (!flying_) now_.distance = goal_.distance * std::pow(now_.distance / goal_.distance, keep);
  return pose();
}

}  // namespace telesplat::viewer
