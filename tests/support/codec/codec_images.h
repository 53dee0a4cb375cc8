// Depth images of all kinds, for properties of the codec, and bounded versions of some.
#pragma once

#include <cstdint>
#include <vector>

#include "common/codec/depth_codec.h"
#include "common/image/depth_image.h"
#include "tests/support/depth_images.h"

namespace telesplat::test {

/// Returns one image of each kind, small enough to try many: planes, terrains, noise; full, of all densities, outlines,
/// bands, patterns.
std::vector<image::DepthImage> codec_images(uint32_t seed);

struct RefinedImage {
  image::DepthImage exact, bounded;
};

/// Always the same images: full, with holes, sparse, narrow, of several tiles; bounds of all kinds.
inline std::vector<RefinedImage> refined_images() {
  using codec::ErrorBounds;
  std::vector<RefinedImage> all;
  const auto add = [&](const image::DepthImage& image, const ErrorBounds& bounds) {
    all.push_back({image, {}});
    codec::encode(image, bounds, &all.back().bounded);
  };
  const ErrorBounds usual = codec::error_bounds(1 / 32.0, 2 / 1280.0, 1, 1);
  const auto kept = [](image::DepthImage image, double density) {
    keep_random(image, density, 3);
    return image;
  };
  add(render({.width = 40, .height = 33}), usual);
  add(render({.width = 34, .height = 40, .rough = true}),
      {.depth = ErrorBounds::kMostDepth, .normal = 3, .colour = 15});
  add(kept(render({.width = 50, .height = 40}), 0.6), usual);
  add(kept(render({.width = 60, .height = 50}), 0.1), usual);
  add(render({.width = 9, .height = 40}), usual);
  add(render({.width = 40, .height = 30, .constant_albedo = true, .covers_all = false}), {.depth = 1u << 22});
  add(random_pixels(30, 20, 1, 4), {.normal = 2, .colour = 3});
  add(kept(plane(300, 260, 30, 20), 0.3), usual);
  add(facets(70, 90, 2), usual);
  return all;
}

}  // namespace telesplat::test
