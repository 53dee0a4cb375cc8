// Slice images depend on no instruction set, no number of threads, and not on how the grid is cut into slabs.
#include <gtest/gtest.h>

#include <random>

#include "services/sampler/shear_splatter.h"
#include "tests/support/simd_targets.h"
#include "tests/support/volume_scenes.h"

namespace telesplat::sampler {
namespace {

geometry::Camera camera_of(std::mt19937& random, int round, double distance_m) {
  std::uniform_real_distribution<double> unit(-0.6, 0.6);
  glm::dvec3 eye(unit(random), unit(random), unit(random));
  eye[round % 3] = round / 3 % 2 ? 1 : -1;
  return geometry::make_camera(
      geometry::look_at(glm::normalize(eye) * distance_m, 0.05 * glm::dvec3(unit(random), unit(random), 0)), 50,
      150 + round, 90);
}

test::VolumeScene scene_of(std::mt19937& random, int round) {
  const auto grid = round % 2 ? test::make_grid({33, 40, 37}, 0.5, {1.4, 1, 0.8}, 35, glm::dvec3(0, 0, 1))
                              : test::make_grid({48, 36, 41}, 0.5);
  // Blobs with noise, so that runs of voxels are long and short; some scenes are opaque.
  const auto value = [&](glm::dvec3 p) { return test::blobs(p) * (0.5 + double(random() % 1000) / 1000); };
  return test::make_scene(grid, value, test::ramp(round % 3 == 0 ? 0.98 : 0.3, round % 4 == 1 ? 80 : 20),
                          round % 5 != 4);
}

void expect_equal(const std::vector<volume::SliceImage>& a, const std::vector<volume::SliceImage>& b,
                  const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  for (size_t n = 0; n < a.size(); ++n) {
    ASSERT_EQ(a[n].layer, b[n].layer) << what;
    ASSERT_EQ(a[n].rect, b[n].rect) << what;
    ASSERT_TRUE(a[n].pixels == b[n].pixels) << what << ", layer " << a[n].layer;
  }
}

TEST(VolumeTargets, ImagesAreTheSameToTheBit) {
  std::mt19937 random(11);
  size_t pixels = 0;
  for (int round = 0; round < 12; ++round) {
    const auto scene = scene_of(random, round);
    const auto camera = camera_of(random, round, round % 4 == 3 ? 6.0 : 0.9);  // far away, pixels hold several voxels
    const auto frame = volume::plan_frame(scene.grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    const SlabVolume volume(scene.grid, scene.voxels);
    const int n = scene.grid.size[2], k = round % 2 ? n : n / 2;
    const auto expected = ShearSplatter(1).splat(volume, scene.colours, *frame, 0, k);
    for (const auto& image : expected) pixels += image.pixels.size();
    for (const int64_t target : testing::simd_targets()) {
      const testing::OnTarget on(target);
      for (const int threads : {1, 3})
        expect_equal(ShearSplatter(threads).splat(volume, scene.colours, *frame, 0, k), expected,
                     hwy::TargetName(target) + (" in round " + std::to_string(round)));
    }
  }
  EXPECT_GT(pixels, 100000u);
}

// One slab or three, composited: the same but for rounding. Tops and bottoms of slabs in and out of view, seen along all axes both ways.
TEST(VolumeTargets, SlabsMeetWithoutSeams) {
  std::mt19937 random(5);
  for (int round = 0; round < 12; ++round) {
    const auto scene = scene_of(random, round);
    const auto camera = camera_of(random, round, round % 4 == 2 ? 0.6 : 0.95);
    const auto frame = volume::plan_frame(scene.grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    const int n = scene.grid.size[2];
    ShearSplatter splatter(2);
    const auto whole = splatter.splat(SlabVolume(scene.grid, scene.voxels), scene.colours, *frame, 0, n);
    std::vector<volume::SliceImage> parts;
    uint64_t voxels = 0;
    for (const auto& [begin, end] : {std::pair{0, n / 3}, {n / 3, n / 3 + 5}, {n / 3 + 5, n}}) {
      const SlabVolume slab(scene.grid, test::part_of(scene, begin - 1, end + 1));
      ShearStats stats;
      for (auto& image : splatter.splat(slab, scene.colours, *frame, begin, end, &stats)) {
        EXPECT_EQ(image.k_begin, begin);
        EXPECT_EQ(image.k_end, end);
        parts.push_back(std::move(image));
      }
      voxels += stats.voxels;
    }
    EXPECT_GT(voxels, 1000u);
    const auto a = test::warp_plainly(scene.grid, *frame, whole, camera, 0x00406080);
    const auto b = test::warp_plainly(scene.grid, *frame, parts, camera, 0x00406080);
    int worst = 0;
    for (size_t p = 0; p < a.colour.size(); ++p)
      for (const int shift : {0, 8, 16})
        worst = std::max(worst, std::abs(int(a.colour[p] >> shift & 255) - int(b.colour[p] >> shift & 255)));
    EXPECT_LE(worst, 2) << "round " << round << ", axis " << frame->axis;
  }
}

}  // namespace
}  // namespace telesplat::sampler
