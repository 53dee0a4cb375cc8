// Head movements: recorded (CSV), an orbit, or standing still.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// Poses over time, interpolated linearly (position) and spherically (orientation).
class Trajectory {
 public:
  /// Reads `t_s,px,py,pz,qw,qx,qy,qz` (header line required, times strictly increasing, at least one row, at most
  /// 10^7). Errors name file and line.
  static Result<Trajectory> read_csv(const std::string& path);
  /// A circle around the origin: radius and height in metres, one turn in `period_s`.
  static Trajectory orbit(double radius_m = 0.75, double height_m = 0.35, double period_s = 20.0);
  /// One pose for ever: half way between front and above, looking at the origin.
  static Trajectory still(const Pose& pose);

  /// Pose at `t_s`; before the first and after the last sample those hold. An orbit goes on for ever.
  Pose at(double t_s) const;
  /// Seconds from first to last sample; 0 for still and orbit.
  double duration_s() const;

 private:
  struct Sample {
    double t_s;
    Pose pose;
  };
  std::vector<Sample> samples_;
  double orbit_radius_m_ = 0, orbit_height_m_ = 0, orbit_period_s_ = 0;
};

/// Pose at `eye` looking at `target`, y up (another up is chosen when looking along y).
Pose look_at(const glm::dvec3& eye, const glm::dvec3& target);

/// The pose `still` uses when none is named.
Pose default_pose();

}  // namespace telesplat::geometry
