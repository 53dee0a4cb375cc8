// A Kalman filter of a head: position with its velocity and acceleration, orientation as the error of a rotation with
// its angular velocity and acceleration (an error-state filter).
//
// Both are the same filter of one axis. Motion: the acceleration is a noise that forgets itself with a time constant
// (R. A. Singer, "Estimating optimal tracking filter performance for manned maneuvering targets", 1970), and so does
// the velocity, with a longer one: heads that turn come to rest. Noise is the same along all axes and so are the gains:
// one covariance of 3 x 3 serves three axes.
#pragma once

#include <glm/matrix.hpp>

#include "common/geometry/camera.h"

namespace telesplat::tracking {

/// Of a unit quaternion; the shorter way round, so at most pi long.
glm::dvec3 rotation_vector(glm::dquat q);
/// The unit quaternion that turns about `v` by its length in radians.
glm::dquat rotation(const glm::dvec3& v);
/// Radians between two orientations, 0 to pi.
double angle_between(const glm::dquat& a, const glm::dquat& b);
/// `v`, or a vector of its direction that is `limit` long where it is longer.
glm::dvec3 clamp_length(const glm::dvec3& v, double limit);

/// Of one axis; metres or radians.
struct MotionNoise {
  double acceleration = 1;    ///< its standard deviation, 1/s^2
  double memory_s = 0.05;     ///< the acceleration's time constant
  double persistence_s = 1;   ///< the velocity's; longer than the acceleration's
  double measurement = 1e-3;  ///< standard deviation of what is measured
};

/// Value, rate and acceleration of a measured motion along three axes.
class MotionFilter {
 public:
  explicit MotionFilter(const MotionNoise& noise) : noise_(noise) {}

  /// Begins anew, at rest as far as is known.
  void begin();
  /// `dt_s` passes: returns how much the value changes.
  glm::dvec3 step(double dt_s);
  /// The value was found to be this much away from where the filter has it; returns by how much it is to be corrected.
  glm::dvec3 correct(const glm::dvec3& difference);
  /// How much the value will change within `dt_s`.
  glm::dvec3 change_within(double dt_s) const;
  const glm::dvec3& rate() const { return rate_; }

 private:
  MotionNoise noise_;
  glm::dvec3 rate_{0.0}, acceleration_{0.0};
  glm::dmat3 covariance_{0.0};
};

/// What the filter takes heads to be like; docs/tracking.md tells how these were found.
struct HeadNoise {
  MotionNoise position{.acceleration = 4, .memory_s = 0.05, .persistence_s = 1, .measurement = 5e-3};
  MotionNoise orientation{.acceleration = 30, .memory_s = 0.01, .persistence_s = 0.15, .measurement = 8e-3};
};

class HeadFilter {
 public:
  explicit HeadFilter(const HeadNoise& noise = {}) : position_(noise.position), orientation_(noise.orientation) {}

  /// Everything before is forgotten; the next pose begins anew.
  void forget() { begun_ = false; }
  /// Precondition: t_s is later than at the last call, unless that is forgotten.
  void add(double t_s, const geometry::Pose& pose);
  /// The pose at t_s, which is not before the newest one that was added. Nothing was: the identity.
  geometry::Pose at(double t_s) const;
  /// m/s and rad/s in room space.
  const glm::dvec3& velocity() const { return position_.rate(); }
  const glm::dvec3& turn() const { return orientation_.rate(); }

 private:
  MotionFilter position_, orientation_;
  geometry::Pose pose_;  // as the filter has it
  double t_s_ = 0;
  bool begun_ = false;
};

}  // namespace telesplat::tracking
