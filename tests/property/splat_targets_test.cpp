// The splatter gives the same bytes on every instruction set of this machine, for every number of left-over lanes, on
// any number of threads; and they equal a plain loop.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "common/geometry/trajectory.h"
#include "common/splat/splat_kernels.h"
#include "tests/support/simd_targets.h"
#include "tests/support/splat_scene.h"

namespace telesplat {
namespace {

using testing::Frame;
using testing::OnTarget;

const std::vector<int64_t> kTargets = testing::simd_targets();

Frame render(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel,
             const image::Shading& shading, int threads = 1) {
  Frame frame(camera.width, camera.height);
  splat::CpuSplatter(threads).render(list, camera, kernel, shading, frame.target());
  return frame;
}

void expect_equal(const Frame& expected, const Frame& actual, const std::string& what) {
  size_t different = 0;
  for (size_t i = 0; i < expected.colour.size(); ++i)
    different += expected.colour[i] != actual.colour[i] || expected.depth_m[i] != actual.depth_m[i];
  EXPECT_EQ(different, 0u) << what << ": pixels that differ from the plain loop's";
}

class SplatTargets : public ::testing::TestWithParam<splat::Kernel> {};

TEST_P(SplatTargets, RandomScenesEqualThePlainLoop) {
  // Sizes that are no multiple of a vector or tile; an off-axis camera that does not look along an axis.
  geometry::Camera camera = geometry::make_camera(geometry::look_at({0.3, 0.2, 0.4}, {0.1, 0, -1}), 80, 531, 287, 0.05);
  camera.left -= 0.2;
  const image::Shading shading({}, camera);
  for (uint32_t seed = 0; seed < 6; ++seed) {
    auto made = testing::random_items(seed, 60, 300);
    std::vector<splat::DrawItem> items;
    for (size_t i = 0; i < made.size(); ++i) items.push_back(made[i].item(1.0f + 0.26f * float(i)));
    const auto list = testing::draw_list(std::move(items));
    const Frame expected = testing::splat_plainly(list, camera, GetParam(), shading);
    ASSERT_NE(std::count_if(expected.depth_m.begin(), expected.depth_m.end(), [](float d) { return std::isfinite(d); }),
              0);
    for (int64_t target : kTargets) {
      const OnTarget on(target);
      expect_equal(expected, render(list, camera, GetParam(), shading), hwy::TargetName(target));
    }
  }
}

TEST_P(SplatTargets, EveryTailLength) {
  const geometry::Camera camera = testing::front_camera(320, 200);
  const image::Shading shading({}, camera);
  for (int size : {1, 2, 3, 7})
    for (int n = 0; n <= 40; ++n) {
      // One item across a tile's border, one within a tile, one across the near plane.
      std::mt19937 rng(static_cast<uint32_t>(n));
      std::vector<testing::HandMadeItem> made;
      made.emplace_back(geometry::Box{{0.3f, -0.2f, -1.5f}, {1.1f, 0.4f, -1.0f}});
      made.emplace_back(geometry::Box{{-0.3f, 0.1f, -1.0f}, {-0.2f, 0.2f, -0.9f}});
      made.emplace_back(geometry::Box{{-0.5f, -0.5f, -0.6f}, {0.5f, 0.5f, 0.4f}});
      std::vector<splat::DrawItem> items;
      for (auto& m : made) {
        for (int i = 0; i < n; ++i)
          m.add(uint16_t(rng()), uint16_t(rng()), uint16_t(rng()), rng() & 0xffffff, i == 0 ? 0xffff : uint16_t(rng()));
        items.push_back(m.item(float(size)));
      }
      const auto list = testing::draw_list(std::move(items));
      const Frame expected = testing::splat_plainly(list, camera, GetParam(), shading);
      for (int64_t target : kTargets) {
        const OnTarget on(target);
        expect_equal(expected, render(list, camera, GetParam(), shading),
                     std::string(hwy::TargetName(target)) + ", " + std::to_string(n) + " points of size " +
                         std::to_string(size));
      }
    }
}

TEST_P(SplatTargets, ThreadsAndReuseDoNotChangeThePicture) {
  const geometry::Camera camera = testing::front_camera(700, 500);
  const image::Shading shading({}, camera);
  auto made = testing::random_items(99, 80, 2000);
  std::vector<splat::DrawItem> items, large;
  for (auto& m : made) items.push_back(m.item(3.0f)), large.push_back(m.item(12.0f));
  const auto list = testing::draw_list(items);
  const Frame expected = testing::splat_plainly(list, camera, GetParam(), shading);
  for (int threads : {1, 2, 3, 8})
    expect_equal(expected, render(list, camera, GetParam(), shading, threads), std::to_string(threads));

  // One splatter, with frames of other sizes and splats in between.
  splat::CpuSplatter splatter(2);
  const geometry::Camera small = testing::front_camera(90, 33);
  Frame frame(700, 500), other(90, 33);
  for (int i = 0; i < 3; ++i) {
    splatter.render(testing::draw_list(large), small, GetParam(), image::Shading({}, small), other.target());
    splatter.render(list, camera, GetParam(), shading, frame.target());
    expect_equal(expected, frame, "reused");
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, SplatTargets, ::testing::Values(splat::Kernel::kSquare, splat::Kernel::kDisc),
                         [](const auto& info) { return info.param == splat::Kernel::kSquare ? "square" : "disc"; });

TEST(SplatTargetList, HoldsSeveral) {
  EXPECT_GE(kTargets.size(), testing::kLeastTargets) << "nothing to compare on this machine";
  for (int64_t target : kTargets) {
    const OnTarget on(target);
#ifndef TELESPLAT_SANITIZED  // else only kernels are compiled for a newer machine
    EXPECT_STREQ(splat::kernel_target(), hwy::TargetName(target));
#endif
  }
}

}  // namespace
}  // namespace telesplat
