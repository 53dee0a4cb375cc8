// A Kalman filter for a head: position with its velocity and acceleration, orientation as the error of a rotation with
// its angular velocity and acceleration (an error-state filter).
//
// Both use the same filter for one axis. Motion model: the acceleration is noise that decays with a time constant (R.
// A. Singer, "Estimating optimal tracking filter performance for manned maneuvering targets", 1970), and the velocity
// decays with a longer one: heads that turn come to rest. Noise is the same along all axes and so are the gains: one
// covariance of 3 x 3 serves three axes.
#pragma once

#include <glm/matrix.hpp>

#include "common/geometry/camera.h"

namespace telesplat::tracking {

/// Converts a unit quaternion to axis times angle; the shorter way round, so at most pi long.
glm::dvec3 rotation_vector(glm::dquat q);
/// Returns the unit quaternion that turns about `v` by its length in radians.
glm::dquat rotation(const glm::dvec3& v);
/// Radians between two orientations, 0 to pi.
double angle_between(const glm::dquat& a, const glm::dquat& b);
/// Returns `v`, shortened to `limit` if it is longer.
glm::dvec3 clamp_length(const glm::dvec3& v, double limit);

/// Noise of one axis; metres or radians.
struct MotionNoise {
  double acceleration = 1;    ///< its standard deviation, 1/s^2
  double memory_s = 0.05;     ///< the acceleration's time constant
  double persistence_s = 1;   ///< the velocity's time constant; longer than memory_s
  double measurement = 1e-3;  ///< standard deviation of measurements
};

/// Value, rate and acceleration of a measured motion along three axes.
class MotionFilter {
 public:
  explicit MotionFilter(const MotionNoise& noise) : noise_(noise) {}

  /// Begins anew, assumed to be at rest.
  void begin();
  /// Advances by `dt_s`; returns the change of the value.
  glm::dvec3 step(double dt_s);
  /// Takes a measurement that differs from the filter's value by this much; returns the correction of the value.
  glm::dvec3 correct(const glm::dvec3& difference);
  /// Predicts the change of the value within `dt_s`.
  glm::dvec3 change_within(double dt_s) const;
  const glm::dvec3& rate() const { return rate_; }

 private:
  MotionNoise noise_;
  glm::dvec3 rate_{0.0}, acceleration_{0.0};
  glm::dmat3 covariance_{0.0};
};

/// Noise that the filter assumes for heads; docs/tracking.md shows how it was found.
struct HeadNoise {
  MotionNoise position{.acceleration = 4, .memory_s = 0.05, .persistence_s = 1, .measurement = 5e-3};
  MotionNoise orientation{.acceleration = 30, .memory_s = 0.01, .persistence_s = 0.15, .measurement = 8e-3};
};

class HeadFilter {
 public:
  explicit HeadFilter(const HeadNoise& noise = {}) : position_(noise.position), orientation_(noise.orientation) {}

  /// Forgets all poses; the next one begins anew.
  void forget() { begun_ = false; }
  /// Precondition: t_s is later than in the last call, except after forget().
  void add(double t_s, const geometry::Pose& pose);
  /// Predicts the pose at t_s, which is not before the newest added pose. Before the first pose: the identity.
  geometry::Pose at(double t_s) const;
  /// m/s and rad/s in room space.
  const glm::dvec3& velocity() const { return position_.rate(); }
  const glm::dvec3& turn() const { return orientation_.rate(); }

 private:
  MotionFilter position_, orientation_;
  geometry::Pose pose_;  // filtered
  double t_s_ = 0;
  bool begun_ = false;
};

}  // namespace telesplat::tracking
