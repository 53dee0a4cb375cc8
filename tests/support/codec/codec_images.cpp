#include "tests/support/codec/codec_images.h"

#include <random>

#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::test {

std::vector<image::DepthImage> codec_images(uint32_t seed) {
  std::mt19937 random(seed);
  const auto side = [&] { return 1 + static_cast<int>(random() % 90); };
  std::vector<image::DepthImage> all;
  all.push_back(
      plane(side(), side(), static_cast<double>(random() % 2000) - 1000, static_cast<double>(random() % 2000) - 1000));
  all.push_back(facets(70 + side(), 70 + side(), seed));
  for (const bool rough : {false, true})
    for (const bool constant : {false, true})
      all.push_back(render({.width = side(),
                            .height = side(),
                            .seed = seed,
                            .rough = rough,
                            .constant_albedo = constant,
                            .covers_all = (seed & 1) != 0}));
  for (const double density : {0.001, 0.01, 0.1, 0.3, 0.6, 0.9, 1.0}) {
    all.push_back(random_pixels(side(), side(), density, seed));
    all.push_back(render({.width = side(), .height = side(), .seed = seed}));
    keep_random(all.back(), density, seed);
  }
  all.push_back(render({.width = side(), .height = side(), .seed = seed, .covers_all = false}));
  keep_outlines(all.back());
  all.push_back(render({.width = side(), .height = side(), .seed = seed, .rough = true}));
  all.back() = masked(all.back(), band_mask(all.back().width, all.back().height, 1 + int(seed % 3)));
  all.push_back(render({.width = side() + 64, .height = side() + 64, .seed = seed}));
  image::PixelMask picks = spread_mask(all.back().width, all.back().height, 32, seed);
  for (int y = 64; y < picks.height(); ++y) *picks.row(y) = *picks.row(y - 64);  // a pattern that repeats
  all.back() = masked(all.back(), picks);
  return all;
}

}  // namespace telesplat::test
