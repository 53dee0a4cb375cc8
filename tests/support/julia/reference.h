// Finds where a ray meets a quaternion Julia set, slowly and in double precision: plain quaternions, short steps,
// bisection. It has the same definition of the surface as the sampler, and none of its shortcuts.
#pragma once

#include <cmath>
#include <optional>

#include "common/geometry/camera.h"
#include "common/julia/distance.h"
#include "common/julia/parameters.h"

namespace telesplat::test {

class JuliaReference {
 public:
  JuliaReference(const julia::Parameters& parameters, const julia::Placement& placement, int iterations = 128)
      : parameters_(parameters), placement_(placement), slice_(julia::slice(parameters)), iterations_(iterations) {}

  /// Distance estimate of a room-space point, in set units.
  double estimate(const glm::dvec3& room) const {
    const glm::dvec3 p = room / placement_.scale + placement_.centre;
    glm::dvec4 q = slice_.origin + p.x * slice_.e[0] + p.y * slice_.e[1] + p.z * slice_.e[2];
    double derivative = 1;
    for (int i = 0; i <= iterations_; ++i) {
      const double length = glm::length(q);
      if (length > parameters_.bailout) return 0.5 * length * std::log(length) / derivative;
      derivative *= 2 * length;
      q = julia::iterate(q, parameters_.c);
    }
    return 0;
  }

  /// Returns the estimate at depth t of a ray minus the threshold there, in set units. footprint_m: the pixel's, metres
  /// a metre.
  double excess(const glm::dvec3& origin, const glm::dvec3& direction, double t, double footprint_m) const {
    return estimate(origin + t * direction) - parameters_.lod * footprint_m * t / placement_.scale;
  }

  /// Returns the depth of the first point of the ray, in the box and beyond `near_m`, where the excess is not positive.
  /// direction: for one unit of depth.
  std::optional<double> meet(const glm::dvec3& origin, const glm::dvec3& direction, double footprint_m,
                             double near_m) const {
    double enter = near_m, leave = 1e30;
    for (int i = 0; i < 3; ++i) {
      const double a = (placement_.box_room.lo[i] - origin[i]) / direction[i],
                   b = (placement_.box_room.hi[i] - origin[i]) / direction[i];
      enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
    }
    const double units = glm::length(direction) / placement_.scale,
                 threshold = parameters_.lod * footprint_m / placement_.scale;
    // Steps a quarter of the free distance at most, but no less than a twentieth of the threshold, so that grazing rays
    // end.
    double before = enter;
    for (double t = enter; t <= leave;) {
      const double free = estimate(origin + t * direction);
      if (free <= threshold * t) {
        for (int i = 0; i < 60 && t > enter; ++i) {
          const double middle = 0.5 * (before + t);
          (excess(origin, direction, middle, footprint_m) <= 0 ? t : before) = middle;
        }
        return t;
      }
      before = t;
      t += std::max(kStep * free, 0.05 * threshold * t) / units;
    }
    return std::nullopt;
  }

 private:
  static constexpr double kStep = 0.25;
  julia::Parameters parameters_;
  julia::Placement placement_;
  julia::Slice slice_;
  int iterations_;
};

}  // namespace telesplat::test
