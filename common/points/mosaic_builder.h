// Fills one mosaic: first its block of points, then its attributes.
#pragma once

#include <array>
#include <cstdint>

#include "common/points/point_model.h"

namespace telesplat::points {

class MosaicBuilder {
 public:
  /// Allocates a mosaic of counts[l] points at level l. Precondition: counts[0] >= counts[1] >= counts[2] > 0.
  MosaicBuilder(Sequence sequence, FrameId frame, const std::array<uint32_t, kLevels>& counts);

  /// Arrays to fill: of counts[0] elements; mean colours of counts[1] and counts[2], null if the level equals the finer
  /// one.
  uint16_t *x, *y, *z, *normal;
  uint32_t *colour, *mean1, *mean2;

  /// Computes normal cone and centroid of the points put there, notes how they were sampled, and returns the mosaic.
  /// direction_to_eye: of any length; zero: the points came from several directions.
  Mosaic finish(float pixel_range, const glm::vec3& direction_to_eye);

 private:
  Mosaic mosaic_;
};

}  // namespace telesplat::points
