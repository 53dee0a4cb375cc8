// How far published points may be from sampled ones, as people say it.
#pragma once

#include <algorithm>

#include "common/codec/error_bounds.h"
#include "common/geometry/camera.h"

namespace telesplat::packer {

struct Tolerance {
  double depth_pixels = 0;  ///< of a pixel's footprint at that depth, along the line of sight; 0: none
  int normal = 0;           ///< codes of the octahedral map, each coordinate
  int colour = 0;           ///< of each channel, of 255

  bool exact() const { return depth_pixels <= 0 && normal <= 0 && colour <= 0; }
  bool operator==(const Tolerance&) const = default;
};

/// The same for the pixels of one camera, those of the finer axis.
inline codec::ErrorBounds bounds_of(const Tolerance& tolerance, const geometry::Camera& camera) {
  if (tolerance.exact()) return {};
  return codec::error_bounds(tolerance.depth_pixels, 1 / std::max(camera.focal_x(), camera.focal_y()), tolerance.normal,
                             tolerance.colour);
}

}  // namespace telesplat::packer
