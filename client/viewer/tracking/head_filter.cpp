#include "client/viewer/tracking/head_filter.h"

#include <algorithm>
#include <cmath>

namespace telesplat::tracking {
namespace {

// Standard deviation of the rate of a head that is seen for the first time.
constexpr double kFirstRate = 1.0;
// The terms of the noise hold for steps that are short beside the acceleration's memory; longer steps count as this.
constexpr double kLongestStep_s = 0.2;

// Effect of `dt_s` on a rate and an acceleration that decay with their time constants: value_of_X: change of the value
// for each unit of X; rate_of_acceleration: part of the acceleration that becomes rate; X_left: part of X that is left.
struct Passed {
  double value_of_rate, value_of_acceleration, rate_of_acceleration, rate_left, acceleration_left;
};
Passed passed(double dt_s, const MotionNoise& n) {
  const double rate_left = std::exp(-dt_s / n.persistence_s), left = std::exp(-dt_s / n.memory_s);
  const double of_rate = n.persistence_s * (1 - rate_left);
  const double k = 1 / (1 / n.memory_s - 1 / n.persistence_s);
  return {of_rate, k * (of_rate - n.memory_s * (1 - left)), k * (rate_left - left), rate_left, left};
}

// Returns the covariance that the acceleration's noise adds within `dt_s`: for times that are short beside its memory
// (Singer 1970, eq. 19), or longer ones, for which the noise is nearly white.
glm::dmat3 noise_within(double dt_s, const MotionNoise& n) {
  const double dt = std::min(dt_s, kLongestStep_s), dt2 = dt * dt, dt3 = dt2 * dt;
  const double a2 = n.acceleration * n.acceleration;
  if (dt > n.memory_s)
    return 2 * a2 * n.memory_s * glm::dmat3(dt3 / 3, dt2 / 2, 0, dt2 / 2, dt, 0, 0, 0, 0.5 / n.memory_s);
  return 2 * a2 / n.memory_s *
         glm::dmat3(dt3 * dt2 / 20, dt2 * dt2 / 8, dt3 / 6, dt2 * dt2 / 8, dt3 / 3, dt2 / 2, dt3 / 6, dt2 / 2, dt);
}

}  // namespace

glm::dvec3 rotation_vector(glm::dquat q) {
  if (q.w < 0) q = -q;
  const glm::dvec3 v(q.x, q.y, q.z);
  const double s = glm::length(v);
  return s < 1e-9 ? 2.0 * v : v / s * 2.0 * std::atan2(s, q.w);
}

glm::dquat rotation(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle < 1e-9 ? glm::dquat(1, 0, 0, 0) : glm::angleAxis(angle, v / angle);
}

double angle_between(const glm::dquat& a, const glm::dquat& b) {
  return glm::length(rotation_vector(a * glm::conjugate(b)));
}

glm::dvec3 clamp_length(const glm::dvec3& v, double limit) {
  const double length = glm::length(v);
  return length > limit ? v * (limit / length) : v;
}

void MotionFilter::begin() {
  rate_ = acceleration_ = glm::dvec3(0);
  const double r = noise_.measurement * noise_.measurement, a = noise_.acceleration * noise_.acceleration;
  covariance_ = glm::dmat3(r, 0, 0, 0, kFirstRate * kFirstRate, 0, 0, 0, a);
}

glm::dvec3 MotionFilter::change_within(double dt_s) const {
  const Passed p = passed(dt_s, noise_);
  return rate_ * p.value_of_rate + acceleration_ * p.value_of_acceleration;
}

glm::dvec3 MotionFilter::step(double dt_s) {
  const glm::dvec3 change = change_within(dt_s);
  const Passed p = passed(dt_s, noise_);
  rate_ = rate_ * p.rate_left + acceleration_ * p.rate_of_acceleration;
  acceleration_ *= p.acceleration_left;
  const glm::dmat3 f = glm::transpose(glm::dmat3(1, p.value_of_rate, p.value_of_acceleration,  //
                                                 0, p.rate_left, p.rate_of_acceleration,       //
                                                 0, 0, p.acceleration_left));
  covariance_ = f * covariance_ * glm::transpose(f) + noise_within(dt_s, noise_);
  return change;
}

glm::dvec3 MotionFilter::correct(const glm::dvec3& difference) {
  const glm::dvec3 column = covariance_[0];
  const glm::dvec3 gain = column / (column.x + noise_.measurement * noise_.measurement);
  rate_ += gain.y * difference;
  acceleration_ += gain.z * difference;
  covariance_ -= glm::outerProduct(gain, column);
  covariance_ = 0.5 * (covariance_ + glm::transpose(covariance_));
  return gain.x * difference;
}

void HeadFilter::add(double t_s, const geometry::Pose& pose) {
  if (!begun_) {
    begun_ = true;
    t_s_ = t_s;
    pose_ = pose;
    position_.begin();
    orientation_.begin();
    return;
  }
  const double dt_s = t_s - t_s_;
  t_s_ = t_s;
  pose_.position_room += position_.step(dt_s);
  pose_.position_room += position_.correct(pose.position_room - pose_.position_room);
  pose_.orientation = rotation(orientation_.step(dt_s)) * pose_.orientation;
  const glm::dvec3 error = rotation_vector(pose.orientation * glm::conjugate(pose_.orientation));
  pose_.orientation = glm::normalize(rotation(orientation_.correct(error)) * pose_.orientation);
}

geometry::Pose HeadFilter::at(double t_s) const {
  const double dt_s = std::max(0.0, t_s - t_s_);
  return {pose_.position_room + position_.change_within(dt_s),
          glm::normalize(rotation(orientation_.change_within(dt_s)) * pose_.orientation)};
}

}  // namespace telesplat::tracking
