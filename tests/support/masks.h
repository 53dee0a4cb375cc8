// Masks like those of plans, for tests and benchmarks.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"

namespace telesplat::test {

/// Sets each pixel with probability `share`.
inline image::PixelMask random_mask(int width, int height, double share, uint32_t seed) {
  image::PixelMask mask(width, height);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (unit(random) < share) mask.set(x, y);
  return mask;
}

/// Sets one pixel in `n`, at a random place in each cell of about `n` pixels: as evenly spread as validation rays are.
inline image::PixelMask spread_mask(int width, int height, int n, uint32_t seed) {
  image::PixelMask mask(width, height);
  std::mt19937 random(seed);
  const int across = std::max(1, static_cast<int>(std::lround(std::sqrt(n)))), down = std::max(1, n / across);
  for (int y = 0; y < height; y += down)
    for (int x = 0; x < width; x += across) {
      const int px = x + static_cast<int>(random() % static_cast<uint32_t>(across));
      const int py = y + static_cast<int>(random() % static_cast<uint32_t>(down));
      if (px < width && py < height) mask.set(px, py);
    }
  return mask;
}

/// Sets bands of `thickness` pixels along circles, like edges and newly uncovered places.
inline image::PixelMask band_mask(int width, int height, int thickness) {
  image::PixelMask mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double r = std::hypot(x - 0.3 * width, y - 0.4 * height);
      if (std::fmod(r, 60.0) < thickness) mask.set(x, y);
    }
  return mask;
}

inline image::PixelMask full_mask(int width, int height) {
  image::PixelMask mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) mask.set(x, y);
  return mask;
}

/// Clears the image's pixels outside the mask.
inline image::DepthImage masked(image::DepthImage image, const image::PixelMask& mask) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (!mask.at(x, y)) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
        image.depth[at] = image.colour[at] = image.normal[at] = 0;
      }
  return image;
}

}  // namespace telesplat::test
