// Depth images with a mask: only some of their pixels are wanted.
#pragma once

#include <algorithm>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"

namespace telesplat::sampler {

/// Empties the pixels outside of the mask. Precondition: both have the same size.
inline void keep_only(const image::PixelMask& mask, image::DepthImage& image) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (mask.at(x, y)) continue;
      const size_t at = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
      image.depth[at] = 0, image.colour[at] = 0, image.normal[at] = 0;
    }
}

/// Returns the smallest rectangle that holds all covered pixels; empty: the mask covers no pixel.
inline geometry::Rect bounds(const image::PixelMask& mask) {
  int left = mask.width(), right = -1, top = mask.height(), bottom = -1;
  for (int y = 0; y < mask.height(); ++y)
    image::for_each_set(mask.row(y), mask.words_per_row(), [&](size_t x) {
      left = std::min(left, static_cast<int>(x)), right = std::max(right, static_cast<int>(x));
      top = std::min(top, y), bottom = y;
    });
  if (right < 0) return {0, 0, 0, 0};
  return {left, top, right - left + 1, bottom - top + 1};
}

}  // namespace telesplat::sampler
