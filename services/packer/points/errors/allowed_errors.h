// How far published points may be from sampled ones, as people say it.
#pragma once

#include <algorithm>
#include <bit>

#include "common/codec/error_bounds.h"
#include "common/geometry/camera.h"

namespace telesplat::packer {

struct AllowedErrors {
  double depth_pixels = 0;  ///< of a pixel's footprint at that depth, along the line of sight; 0: none
  int normal = 0;           ///< codes of the octahedral map, each coordinate
  int colour = 0;           ///< of each channel, of 255

  bool exact() const { return depth_pixels <= 0 && normal <= 0 && colour <= 0; }
  bool operator==(const AllowedErrors&) const = default;
};

/// The same for the pixels of one camera, those of the finer axis. Frusta are wider the faster a head moves: bounds of
/// depth are rounded down to one of 16 an octave, so that coders, which keep tables by bound, do not make one a frame.
inline codec::ErrorBounds bounds_of(const AllowedErrors& allowed, const geometry::Camera& camera) {
  if (allowed.exact()) return {};
  constexpr int kBits = 5;
  auto out = codec::error_bounds(allowed.depth_pixels, 1 / std::max(camera.focal_x(), camera.focal_y()),
                                 allowed.normal, allowed.colour);
  if (const int below = std::bit_width(out.depth) - kBits; below > 0) out.depth = out.depth >> below << below;
  return out;
}

}  // namespace telesplat::packer
