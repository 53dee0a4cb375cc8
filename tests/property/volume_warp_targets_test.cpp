// The warp gives the same pixels on every instruction set, for every width of tile and place of its borders, as the
// pixel by its definition.
#include <gtest/gtest.h>

#include "common/volume/warp/pixel.h"
#include "common/volume/warp/plan.h"
#include "tests/support/simd_targets.h"
#include "tests/support/volume/frames.h"

namespace telesplat::volume {
namespace {

using testing::blob_frame, testing::looking_at, testing::orbit, testing::turned_grid, testing::WarpedView;

constexpr uint32_t kBackground = 0x305070;

// Does the same as Warper::render, pixel by pixel, every layer everywhere.
WarpedView plainly(const VolumeFrame& frame, const geometry::Camera& camera) {
  WarpedView out(camera);
  const WarpPlan plan(frame, camera);
  std::vector<WarpLayer> layers;
  for (int ty = 0; ty < plan.tiles_y(); ++ty)
    for (int tx = 0; tx < plan.tiles_x(); ++tx) {
      WarpTile tile;
      plan.place(tx, ty, tile, layers);
      tile.background = kBackground;
      const geometry::Rect rect = plan.rect(tx, ty);
      const uint64_t all = layers.size() == 64 ? ~uint64_t{0} : (uint64_t{1} << layers.size()) - 1;
      uint64_t samples = 0;
      for (int y = 0; y < rect.height; ++y)
        for (int x = 0; x < rect.width; ++x) {
          const WarpedPixel pixel = warp_pixel(tile, all, tile.x0 + x, tile.y0 + y, samples);
          out.colour[out.at(rect.x + x, rect.y + y)] = pixel.colour;
          out.depth_m[out.at(rect.x + x, rect.y + y)] = pixel.depth_m;
        }
    }
  return out;
}

void expect_same_on_every_target(const VolumeFrame& frame, const geometry::Camera& camera) {
  const WarpedView expected = plainly(frame, camera);
  for (const int64_t target : testing::simd_targets()) {
    const testing::OnTarget on(target);
    for (const bool with_depth : {true, false}) {
      WarpedView view(camera);
      WarpTarget to = view.target();
      if (!with_depth) to.depth_m = nullptr;
      Warper(1).render(&frame, camera, kBackground, to);
      for (size_t i = 0; i < view.colour.size(); ++i) {
        ASSERT_EQ(view.colour[i], expected.colour[i])
            << hwy::TargetName(target) << ", width " << camera.width << ", pixel " << i;
        ASSERT_EQ(with_depth ? view.depth_m[i] : expected.depth_m[i], expected.depth_m[i])
            << hwy::TargetName(target) << ", pixel " << i;
      }
    }
  }
}

TEST(VolumeWarp, EveryTargetAndWidthEqualsThePlainPixel) {
  const Grid grid = turned_grid();
  const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.9, 0.4, 0.2), 200, 150);
  const VolumeFrame frame = blob_frame(grid, sampled);
  for (int width = 1; width <= 70; width += width < 40 ? 1 : 10) {
    auto camera = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.5, 0.25), width, 9 + width % 7, 20);
    camera.left += 0.013 * width, camera.right += 0.013 * width;  // borders of tiles lie elsewhere
    expect_same_on_every_target(frame, camera);
  }
}

TEST(VolumeWarp, EveryTargetEqualsThePlainPixelWhereverTheEyeIs) {
  const Grid grid = turned_grid();
  for (int n = 0; n < 8; ++n) {
    const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.9 * n, 0.3), 120, 90);
    const VolumeFrame frame = blob_frame(grid, sampled, n == 0 ? 64 : 12);
    const double distance_m = n % 3 == 2 ? 0.05 : 0.7;  // some among the layers, with planes edge-on
    expect_same_on_every_target(frame,
                                looking_at(grid.centre_room(), orbit(grid, distance_m, 1.2 * n, 0.1), 130, 100, 90));
  }
}

// Pixels that no sampler makes: colours above their opacity.
TEST(VolumeWarp, EveryTargetSaturatesAlike) {
  const Grid grid = turned_grid();
  const auto camera = looking_at(grid.centre_room(), orbit(grid, 0.9, 0.4, 0.2), 100, 80);
  const ShearFrame shear = plan_frame(grid, std::span(&camera, 1)).value();
  std::mt19937 random(8);
  std::vector<SliceImage> images;
  for (int l = 0; l < static_cast<int>(shear.layers.size()); ++l) {
    SliceImage image{l, 0, 40, {0, 0, shear.width, shear.height}, {}};
    for (int i = 0; i < shear.width * shear.height; ++i)
      image.pixels.push_back(random() % 3 ? static_cast<uint32_t>(random()) : 0xffffffu);
    images.push_back(std::move(image));
  }
  expect_same_on_every_target(testing::frame_of(grid, shear, images), camera);
}

}  // namespace
}  // namespace telesplat::volume
