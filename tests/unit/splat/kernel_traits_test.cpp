#include "common/splat/kernel_traits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/splat/item_figures.h"
#include "common/splat/surfel/splat.h"
#include "tests/support/splat_scene.h"

namespace telesplat {
namespace {

using splat::Kernel;

TEST(KernelTraits, NamesAndKeysFindTheirKernel) {
  for (const Kernel kernel : splat::kKernels) {
    EXPECT_EQ(splat::kernel_named(splat::kernel_name(kernel)), kernel);
    EXPECT_EQ(splat::kernel_of_key(splat::traits_of(kernel).window_key), kernel);
  }
  EXPECT_FALSE(splat::kernel_named("Square"));
  EXPECT_FALSE(splat::kernel_named(""));
  EXPECT_FALSE(splat::kernel_of_key('x'));
}

TEST(KernelTraits, TheListForFlagsIsTheTable) {
  EXPECT_EQ(splat::kernel_names(), (std::vector<std::string>{"square", "disc", "ellipse", "ewa"}));
  EXPECT_EQ(splat::kernel_list(), "square, disc, ellipse or ewa");
}

TEST(KernelTraits, ARowHasWhatItsKindOfSplatNeeds) {
  std::set<std::string_view> names;
  for (const Kernel kernel : splat::kKernels) {
    const splat::KernelTraits& t = splat::traits_of(kernel);
    EXPECT_EQ(t.kernel, kernel);
    EXPECT_TRUE(names.insert(t.name).second) << t.name;
    EXPECT_NE(t.splat_tile, nullptr) << t.name;
    EXPECT_GT(t.tile_width, 0) << t.name;
    EXPECT_GT(t.tile_height, 0) << t.name;
    EXPECT_GT(t.suitable_scale, 0) << t.name;
    EXPECT_EQ(t.surfel, t.flat_distance2 == nullptr) << t.name;
    EXPECT_EQ(t.surfel, t.flat_contour_r2 == 0) << t.name;
    EXPECT_EQ(t.surfel, t.reach.growth > 0) << t.name;
    EXPECT_TRUE(t.surfel || t.passes == splat::Passes::kKeys) << t.name;
    // Sums carry no ring, so a bias could not be taken off them again.
    EXPECT_TRUE(t.passes == splat::Passes::kKeys || !t.surfel_bias) << t.name;
  }
}

// Two items: 3 points of 2.1 pixels and 1 point of 9 pixels, 1 m and 2 m before the eye.
struct TwoItems {
  testing::HandMadeItem near{{{-0.1f, -0.1f, -1.1f}, {0.1f, 0.1f, -0.9f}}},
      far{{{-0.1f, -0.1f, -2.1f}, {0.1f, 0.1f, -1.9f}}};
  std::vector<splat::DrawItem> items;
  TwoItems() {
    for (int i = 0; i < 3; ++i) near.add(1, 2, 3, 0xffffff);
    far.add(1, 2, 3, 0xffffff);
    items = {near.item(2.1f), far.item(9.0f)};
    items[0].radius_m = 0.002f, items[1].radius_m = 0.001f;
  }
};

TEST(FrameFigures, FlatSplatsAreSizedAndBiasedByTheTable) {
  const TwoItems scene;
  const geometry::Camera camera = testing::front_camera(640, 480);
  for (const Kernel kernel : {Kernel::kSquare, Kernel::kDisc}) {
    splat::FrameFigures figures(splat::traits_of(kernel), camera, 1.0f);
    const splat::ItemFigures first = figures.add(scene.items[0]), second = figures.add(scene.items[1]);
    EXPECT_EQ(first.flat->size, 2.25f);
    EXPECT_EQ(first.flat->side, 3);
    EXPECT_EQ(first.flat->sub_bits, 3);
    EXPECT_EQ(second.flat->size, 9.0f);
    EXPECT_EQ(second.flat->sub_bits, 2);
    const bool disc = kernel == Kernel::kDisc;
    EXPECT_EQ(first.spacing, disc ? 2u : 0u);
    EXPECT_EQ(second.spacing, disc ? 3u : 0u);
    const auto bias = [&](double size, int side) {
      return splat::splat_bias((disc ? 0.25 : 0.5) * size * size, side, camera.focal_x());
    };
    EXPECT_EQ(first.flat->rim_bias, bias(2.25, 3));
    EXPECT_EQ(second.flat->rim_bias, bias(9, 9));
    const splat::RimBias rim = figures.rim();
    if (disc)
      EXPECT_EQ(rim, (splat::RimBias{0, 0, bias(2.25, 3), bias(9, 9)}));
    else
      EXPECT_EQ(rim, (splat::RimBias{uint32_t(std::lround((3.0 * bias(2.25, 3) + bias(9, 9)) / 4)), 0, 0, 0}));
  }
}

TEST(FrameFigures, EllipsesAreBiasedAtTheirLeafsCentreAndEwaIsNot) {
  const TwoItems scene;
  const geometry::Camera camera = testing::front_camera(640, 480);
  splat::FrameFigures ellipses(splat::traits_of(Kernel::kEllipse), camera, 1.0f);
  splat::FrameFigures ewa(splat::traits_of(Kernel::kEwa), camera, 1.0f);
  for (const splat::DrawItem& item : scene.items) {
    EXPECT_EQ(ellipses.add(item).source.radius_m, item.radius_m);
    EXPECT_EQ(ewa.add(item).flat, nullptr);
  }
  const auto bias = [](float radius_m, float depth_m) {
    return uint32_t(std::lround(splat::ellipse_bias(radius_m, depth_m)));
  };
  EXPECT_EQ(ellipses.rim(), (splat::RimBias{0, 0, bias(0.002f, 1), bias(0.001f, 2)}));
  EXPECT_EQ(ewa.rim(), splat::RimBias{});
}

TEST(FrameFigures, AnEllipseNearerThanTheNearPlaneHasNoBias) {
  testing::HandMadeItem behind({{-0.1f, -0.1f, 0.9f}, {0.1f, 0.1f, 1.1f}});
  behind.add(1, 2, 3, 0xffffff);
  splat::DrawItem item = behind.item(4.0f);
  item.radius_m = 0.01f;
  splat::FrameFigures figures(splat::traits_of(Kernel::kEllipse), testing::front_camera(640, 480), 1.0f);
  figures.add(item);
  EXPECT_EQ(figures.rim(), splat::RimBias{});
}

}  // namespace
}  // namespace telesplat
