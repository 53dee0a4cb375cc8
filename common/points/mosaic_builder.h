// Fills one mosaic: its block of points first, its attributes then.
#pragma once

#include <array>
#include <cstdint>

#include "common/points/point_model.h"

namespace telesplat::points {

class MosaicBuilder {
 public:
  /// Allocates a mosaic of counts[l] points at level l. Precondition: counts[0] >= counts[1] >= counts[2] > 0.
  MosaicBuilder(Sequence sequence, FrameId frame, const std::array<uint32_t, kLevels>& counts);

  /// Where the points go: arrays of counts[0]; mean colours of counts[1] and counts[2], null where the level is as the
  /// finer one.
  uint16_t *x, *y, *z, *normal;
  uint32_t *colour, *mean1, *mean2;

  /// Computes normal cone and centroid of the points put there, notes how they were sampled, and hands the mosaic out.
  /// direction_to_eye: need not be of unit length; zero: from several.
  Mosaic finish(float pixel_range, const glm::vec3& direction_to_eye);

 private:
  Mosaic mosaic_;
};

}  // namespace telesplat::points
