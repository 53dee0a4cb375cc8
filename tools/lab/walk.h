// Head movements that benchmarks replay, and the tiles that they cut views into.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/trajectory.h"
#include "common/image/depth_image.h"

namespace telesplat::lab {

/// Several recorded walks, one after the other, round and round.
class Walk {
 public:
  /// names: CSV files of poses, or "orbit" (20 s of it), with commas between. Error: a file that is none, or that takes
  /// no time.
  static Result<Walk> open(const std::string& names);
  geometry::Pose at(double t_s) const;
  double length_s() const { return ends_s_.empty() ? 0 : ends_s_.back(); }

 private:
  std::vector<geometry::Trajectory> parts_;
  std::vector<double> ends_s_;
};

/// The pixels `part` of an image. Precondition: the part lies in it.
image::DepthImage cut(const image::DepthImage& whole, const geometry::Rect& part);

}  // namespace telesplat::lab
