// A mask changes which pixels are sampled, not their values: for any mask, tile, camera and sampler.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "common/geometry/trajectory.h"
#include "services/sampler/julia/sampler.h"
#include "services/sampler/mesh/masked_pixels.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/julia/plain.h"
#include "tests/support/masks.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

using geometry::Camera;
using geometry::Rect;
using image::DepthImage;
using image::PixelMask;

std::vector<PixelMask> masks(int width, int height, uint32_t seed) {
  std::vector<PixelMask> all{PixelMask(width, height), test::full_mask(width, height),
                             test::spread_mask(width, height, 32, seed), test::band_mask(width, height, 3)};
  for (const double share : {0.001, 0.1, 0.5, 0.99}) all.push_back(test::random_mask(width, height, share, seed));
  all.push_back(PixelMask(width, height));
  all.back().set(width - 1, height - 1);
  all.push_back(PixelMask(width, height));
  for (int x = 0; x < width; ++x) all.back().set(x, height / 2);
  return all;
}

// Cameras of frames up to 10240 x 6400, with tiles at any place.
struct View {
  Camera camera;
  Rect tile;
};
std::vector<View> views(uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<View> out;
  for (const auto& [width, height] : {std::pair{320, 200}, {1283, 801}, {10240, 6400}}) {
    const glm::dvec3 direction = glm::normalize(glm::dvec3(unit(random), 0.3 + 0.5 * std::abs(unit(random)), 1));
    Camera c = geometry::make_camera(geometry::look_at(0.9 * direction, {0, 0, 0}), 60, width, height);
    if (width == 1283) c.left -= 0.1, c.top += 0.1;  // off axis
    const int w = 65 + static_cast<int>(random() % 70), h = 33 + static_cast<int>(random() % 60);
    out.push_back({c, {width / 2 - w / 2 + 3, height / 2 - h / 2 + 1, w, h}});
  }
  return out;
}

struct Tally {
  size_t covered = 0, different = 0;
};
void compare(const DepthImage& got, const DepthImage& all, const PixelMask& mask, Tally& tally) {
  const DepthImage expected = test::masked(all, mask);
  ASSERT_EQ(got.width, expected.width);
  ASSERT_EQ(got.height, expected.height);
  for (size_t i = 0; i < expected.pixels(); ++i) {
    if (!mask.at(static_cast<int>(i) % got.width, static_cast<int>(i) / got.width)) {
      ASSERT_TRUE(got.depth[i] == 0 && got.colour[i] == 0 && got.normal[i] == 0) << i << " was not asked for";
      continue;
    }
    tally.covered += expected.depth[i] != 0;
    tally.different +=
        got.depth[i] != expected.depth[i] || got.colour[i] != expected.colour[i] || got.normal[i] != expected.normal[i];
  }
}

Tally compare_all(Sampler& sampler, uint32_t seed) {
  Tally tally;
  for (const View& v : views(seed)) {
    const DepthImage all = sampler.sample(v.camera, v.tile);
    for (const PixelMask& mask : masks(v.tile.width, v.tile.height, seed))
      compare(sampler.sample(v.camera, v.tile, &mask), all, mask, tally);
  }
  return tally;
}

TEST(MaskedSampling, RaysGiveWhatTheyGiveWithoutAMask) {
  for (const int threads : {1, 3}) {
    const auto sampler = make_ray_sampler(threads);
    ASSERT_TRUE(sampler->add_chunks(test::terrain(300, 100)).ok());
    for (uint32_t seed = 1; seed <= 4; ++seed) {
      const Tally t = compare_all(*sampler, seed);
      EXPECT_GT(t.covered, 30000u);
      EXPECT_LE(t.different, t.covered / 2000) << "but where two triangles are equally near";
    }
  }
}

TEST(MaskedSampling, TheRasteriserGivesWhatItGivesWithoutAMask) {
  auto made = make_raster_sampler();
  if (!made) GTEST_SKIP() << made.error().text;
  ASSERT_TRUE((*made)->add_chunks(test::terrain(300, 100)).ok());
  for (uint32_t seed = 1; seed <= 2; ++seed) {
    const Tally t = compare_all(**made, seed);
    EXPECT_GT(t.covered, 30000u);
    EXPECT_EQ(t.different, 0u);
  }
}

TEST(MaskedSampling, JuliaRaysGiveExactlyWhatTheyGiveWithoutAMask) {
  const julia::Parameters& parameters = julia::presets()[0].parameters;
  const JuliaScene scene(parameters, julia::place(julia::bounds(parameters), 0.8));
  for (const int threads : {1, 3})
    for (const int step : {1, 4}) {
      JuliaSampler sampler(threads), plain(threads, julia_trace_plainly);
      Tally t;
      for (const View& v : views(7)) {
        const DepthImage all = sampler.sample(scene, v.camera, v.tile, 1.0 / step);
        for (const PixelMask& mask : masks(v.tile.width, v.tile.height, 7)) {
          const DepthImage image = sampler.sample(scene, v.camera, v.tile, 1.0 / step, &mask);
          compare(image, all, mask, t);
          if (mask.count() < 1000) {
            ASSERT_EQ(image, plain.sample(scene, v.camera, v.tile, 1.0 / step, &mask));
          }
        }
      }
      EXPECT_GT(t.covered, 10000u);
      EXPECT_EQ(t.different, 0u);
    }
}

TEST(MaskedPixels, AreThoseOfTheMaskEachOnceAndCloseTogether) {
  std::mt19937 random(3);
  for (int round = 0; round < 40; ++round) {
    const int width = 1 + static_cast<int>(random() % 200), height = 1 + static_cast<int>(random() % 200);
    for (const PixelMask& mask : masks(width, height, static_cast<uint32_t>(round))) {
      const auto pixels = gather(mask);
      std::set<std::pair<int, int>> seen;
      for (const MaskedPixel p : pixels) {
        ASSERT_TRUE(p.x >= 0 && p.y >= 0 && p.x < width && p.y < height);
        ASSERT_TRUE(mask.at(p.x, p.y));
        ASSERT_TRUE(seen.emplace(p.x, p.y).second) << p.x << "," << p.y << " twice";
      }
      ASSERT_EQ(seen.size(), mask.count());
    }
  }
  // Full mask: every eight pixels are a block of 4 x 2. One in 32: eight lie mostly within 32 x 32.
  const auto full = gather(test::full_mask(64, 64));
  for (size_t i = 0; i < full.size(); i += 8)
    for (size_t k = 0; k < 8; ++k) {
      EXPECT_EQ(full[i + k].x, full[i].x + int(k % 4));
      EXPECT_EQ(full[i + k].y, full[i].y + int(k / 4));
    }
}

}  // namespace
}  // namespace telesplat::sampler
