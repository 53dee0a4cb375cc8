// Slice images do not depend on instruction set, number of threads, or the grid's cut into slabs.
#include <gtest/gtest.h>

#include <random>

#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/simd_targets.h"
#include "tests/support/volume/scenes.h"

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
  // Blobs with noise make long and short runs of voxels; some scenes are opaque.
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
    const auto expected = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, k});
    for (const auto& image : expected) pixels += image.pixels.size();
    for (const int64_t target : testing::simd_targets()) {
      const testing::OnTarget on(target);
      for (const int threads : {1, 3})
        expect_equal(ShearSplatter(threads).splat(volume, scene.colours, *frame, {0, k}), expected,
                     hwy::TargetName(target) + (" in round " + std::to_string(round)));
    }
  }
  EXPECT_GT(pixels, 100000u);
}

// Composites all images, pixel by pixel of the raster; slabs share out every slice's pixels: nearer layers first, and
// within a layer the slabs that are nearer to the eye along k.
std::vector<glm::dvec4> composite(const volume::ShearFrame& frame, const std::vector<volume::SliceImage>& images) {
  std::vector<const volume::SliceImage*> order;
  for (const auto& image : images) order.push_back(&image);
  const auto distance = [&](const volume::SliceImage& i) {
    return std::max({i.k_begin - 0.5 - frame.eye.z, frame.eye.z - (i.k_end - 0.5), 0.0});
  };
  std::stable_sort(order.begin(), order.end(), [&](const auto* a, const auto* b) {
    return a->layer != b->layer ? a->layer < b->layer : distance(*a) < distance(*b);
  });
  std::vector<glm::dvec4> out(size_t(frame.width) * size_t(frame.height), glm::dvec4(0));
  for (const auto* image : order)
    for (int y = 0; y < image->rect.height; ++y)
      for (int x = 0; x < image->rect.width; ++x) {
        glm::dvec4& to = out[size_t(image->rect.y + y) * size_t(frame.width) + size_t(image->rect.x + x)];
        to += (1 - to.w) * test::look_up(*image, image->rect.x + x + 0.5, image->rect.y + y + 0.5);
      }
  return out;
}

// One slab or three give the same composite except for rounding. Ends of slabs lie in and out of view, seen along all
// axes both ways.
TEST(VolumeTargets, SlabsMeetWithoutSeams) {
  std::mt19937 random(5);
  for (int round = 0; round < 12; ++round) {
    const auto scene = scene_of(random, round);
    const auto camera = camera_of(random, round, round % 4 == 2 ? 0.6 : 0.95);
    const auto frame = volume::plan_frame(scene.grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    const int n = scene.grid.size[2];
    ShearSplatter splatter(2);
    const auto whole = splatter.splat(SlabVolume(scene.grid, scene.voxels), scene.colours, *frame, {0, n});
    std::vector<volume::SliceImage> parts;
    uint64_t voxels = 0;
    for (const auto& [begin, end] : {std::pair{0, n / 3}, {n / 3, n / 3 + 5}, {n / 3 + 5, n}}) {
      const SlabVolume slab(scene.grid, test::part_of(scene, begin - 1, end + 1));
      ShearStats stats;
      for (auto& image : splatter.splat(slab, scene.colours, *frame, {begin, end}, &stats)) {
        EXPECT_EQ(image.k_begin, begin);
        EXPECT_EQ(image.k_end, end);
        parts.push_back(std::move(image));
      }
      voxels += stats.voxels;
    }
    EXPECT_GT(voxels, 1000u);
    const auto a = composite(*frame, whole), b = composite(*frame, parts);
    double worst = 0;  // in steps of 8-bit output, which is what is shown
    for (size_t p = 0; p < a.size(); ++p)
      for (int c = 0; c < 4; ++c)
        worst = std::max(worst, std::abs(std::round(255 * a[p][c]) - std::round(255 * b[p][c])));
    EXPECT_LE(worst, 2) << "round " << round << ", axis " << frame->axis;
  }
}

}  // namespace
}  // namespace telesplat::sampler
