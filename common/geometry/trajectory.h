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
  struct Sample {
    double t_s;
    Pose pose;
  };
  /// Reads a CSV file whose header names t_s, px, py, pz, qw, qx, qy and qz, in any order; ignores other columns. With
  /// a column "viewer" only the first viewer's rows count (viewer-1 before viewer-2 before viewer-10). So the
  /// frames.csv of a run is a trajectory. Times strictly increase; at least one row, at most 10^7. Skips a byte-order
  /// mark and blanks around values. Errors name file and line.
  static Result<Trajectory> read_csv(const std::string& path);
  /// A circle around a point, at `height_m` above it: one turn in `period_s`, beginning on its +z side.
  static Trajectory orbit(double radius_m = 0.75, double height_m = 0.35, double period_s = 20.0,
                          const glm::dvec3& centre = glm::dvec3(0));
  /// One pose for ever.
  static Trajectory still(const Pose& pose);
  /// Precondition: at least one sample, times strictly increase.
  static Trajectory of(std::vector<Sample> samples);

  /// Pose at `t_s`. Before the first sample and after the last, that sample holds, unless it repeats. An orbit goes on
  /// for ever.
  Pose at(double t_s) const;
  /// Seconds from first to last sample; 0 for still and orbit.
  double duration_s() const;
  /// True if the head rests after duration_s().
  bool ends() const { return !repeats_ && duration_s() > 0; }
  /// From now on it starts again at its end.
  void repeat() { repeats_ = true; }

 private:
  std::vector<Sample> samples_;
  bool repeats_ = false;
  double orbit_radius_m_ = 0, orbit_height_m_ = 0, orbit_period_s_ = 0;
  glm::dvec3 orbit_centre_{0.0};
};

/// Reads the samples as Trajectory::read_csv does, with the file's times. Same errors.
Result<std::vector<Trajectory::Sample>> read_samples(const std::string& path);

/// Writes a CSV file that Trajectory::read_csv reads.
Status write_trajectory(const std::string& path, const std::vector<Trajectory::Sample>& samples);

/// Pose at `eye` looking at `target`, y up (another axis is up when looking along y). If both are the same point: along
/// -z.
Pose look_at(const glm::dvec3& eye, const glm::dvec3& target);

/// A pose that suits a data set of 0.8 m at the origin, for benchmarks; windows begin with a fitted one (fit.h).
Pose default_pose();

}  // namespace telesplat::geometry
