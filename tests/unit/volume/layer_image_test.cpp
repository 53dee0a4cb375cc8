#include "common/volume/warp/layer_image.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/volume/frames.h"

namespace telesplat::volume {
namespace {

using testing::looking_at, testing::orbit, testing::turned_grid;

ShearFrame a_shear(const glm::dvec3& eye, int width = 60, int height = 50) {
  ShearFrame out;
  out.axis = 0, out.direction = 1, out.eye = eye, out.width = width, out.height = height;
  out.layers = {{0, 8, 3.5}, {8, 16, 11.5}};
  return out;
}

SliceImage image_of(int layer, int k_begin, int k_end, const geometry::Rect& rect, uint32_t pixel) {
  return {layer, k_begin, k_end, rect,
          std::vector<uint32_t>(static_cast<size_t>(rect.width) * static_cast<size_t>(rect.height), pixel)};
}

TEST(VolumeLayerImage, SlabsLieBehindEachOtherByDistanceAlongK) {
  std::vector<SliceImage> images;
  for (const int k : {0, 10, 20, 30})
    for (const int layer : {1, 0}) images.push_back(image_of(layer, k, k + 10, {0, 0, 1, 1}, 1));
  using Order = std::vector<int>;
  EXPECT_EQ(slab_order(images, {-9, 0, -5}), (Order{1, 3, 5, 7, 0, 2, 4, 6}));
  EXPECT_EQ(slab_order(images, {-9, 0, 50}), (Order{7, 5, 3, 1, 6, 4, 2, 0}));
  EXPECT_EQ(slab_order(images, {-9, 0, 16}), (Order{3, 5, 1, 7, 2, 4, 0, 6}));
}

TEST(VolumeLayerImage, OverlappingSlabsAreCompositedNearestFirst) {
  const ShearFrame shear = a_shear({-30, 10, -5});
  const auto far = image_of(0, 10, 20, {10, 10, 20, 20}, 0xff0000ffu),
             near = image_of(0, 0, 10, {20, 5, 20, 20}, 0x80008000u);
  const auto layers = merge_layers(std::vector{far, near}, shear);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].rect, (geometry::Rect{10, 5, 30, 25}));
  const auto at = [&](int x, int y) { return layers[0].row(y - 5)[x - 10]; };
  EXPECT_EQ(at(10, 10), 0xff0000ffu);
  EXPECT_EQ(at(35, 5), 0x80008000u);
  EXPECT_EQ(at(25, 20), 0xff00807fu);  // 128 + 255 * 127 / 255, and 255 * 127 / 255
  EXPECT_EQ(at(12, 6), 0u);
  EXPECT_EQ(merge_layers(std::vector{near, far}, shear)[0].texels, layers[0].texels);
}

TEST(VolumeLayerImage, LayersComeInOrderAndHaveATransparentFrame) {
  const auto layers = merge_layers(
      std::vector{image_of(1, 0, 10, {0, 0, 60, 50}, 0xffffffffu), image_of(0, 0, 10, {3, 4, 5, 6}, 0xffffffffu)},
      a_shear({-30, 0, 0}));
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].layer, 0);
  EXPECT_EQ(layers[1].layer, 1);
  for (const auto& l : layers) {
    ASSERT_EQ(l.texels.size(), static_cast<size_t>(l.pitch) * static_cast<size_t>(l.rows()));
    for (int y = 0; y < l.rows(); ++y)
      for (int x = 0; x < l.pitch; ++x) {
        const bool inside = x >= 1 && x <= l.rect.width && y >= 1 && y <= l.rect.height;
        ASSERT_EQ(l.texels[static_cast<size_t>(y * l.pitch + x)], inside ? 0xffffffffu : 0u);
      }
  }
}

TEST(VolumeLayerImage, WhatDoesNotFitTheFrameIsDropped) {
  const ShearFrame shear = a_shear({-30, 0, 0});
  auto short_of_pixels = image_of(0, 0, 1, {0, 0, 9, 9}, 1);
  short_of_pixels.pixels.pop_back();
  const std::vector<SliceImage> bad{image_of(2, 0, 1, {0, 0, 1, 1}, 1),  image_of(-1, 0, 1, {0, 0, 1, 1}, 1),
                                    image_of(0, 0, 1, {-1, 0, 1, 1}, 1), image_of(0, 0, 1, {59, 0, 2, 1}, 1),
                                    image_of(0, 0, 1, {0, 45, 1, 6}, 1), image_of(0, 0, 1, {0, 0, 0, 5}, 1),
                                    image_of(0, 0, 1, {0, 0, 5, 0}, 1),  short_of_pixels};
  EXPECT_TRUE(merge_layers(bad, shear).empty());
  EXPECT_TRUE(merge_layers({}, shear).empty());
}

TEST(VolumeLayerImage, FilledSaysWhereThereMayBeAnything) {
  std::mt19937 random(4);
  int empty = 0;
  for (int round = 0; round < 50; ++round) {
    auto image =
        image_of(0, 0, 1, {0, 0, 40 + static_cast<int>(random() % 30), 40 + static_cast<int>(random() % 30)}, 0);
    for (int n = 0; n < 3; ++n) image.pixels[random() % image.pixels.size()] = 0x01000000u;
    const auto layer = merge_layers(std::vector{image}, a_shear({-30, 0, 0}, 80, 80)).at(0);
    for (int n = 0; n < 200; ++n) {
      int x0 = static_cast<int>(random() % static_cast<unsigned>(layer.pitch)),
          x1 = static_cast<int>(random() % static_cast<unsigned>(layer.pitch));
      int y0 = static_cast<int>(random() % static_cast<unsigned>(layer.rows())),
          y1 = static_cast<int>(random() % static_cast<unsigned>(layer.rows()));
      if (x0 > x1) std::swap(x0, x1);
      if (y0 > y1) std::swap(y0, y1);
      bool any = false;
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) any |= layer.texels[static_cast<size_t>(y * layer.pitch + x)] != 0;
      const bool may_be = layer.may_fill(x0, y0, x1, y1);
      EXPECT_TRUE(may_be || !any);
      empty += !may_be;
    }
  }
  EXPECT_GT(empty, 500);
}

// The reason for merging: however a layer's slices are divided among slabs, the picture is the one of a single slab.
TEST(VolumeLayerImage, SlabsOfAnOpaqueBlockMeetWithoutASeam) {
  const Grid grid = turned_grid();
  int shared_out = 0;
  for (int n = 0; n < 12; ++n) {
    const auto camera = looking_at(grid.centre_room(), orbit(grid, 0.9, 0.55 * n, 0.4 * std::sin(n)), 160, 120);
    PlanOptions options;
    options.layers = 4;
    const ShearFrame shear = plan_frame(grid, std::span(&camera, 1), options).value();
    if (shear.axis == 2) continue;  // slabs are ranges of slices then, and share no slice
    // Every slice is opaque in the pixels that the slab owns, as samplers draw a solid block.
    const auto frame_of_slabs = [&](const std::vector<std::pair<int, int>>& slabs) {
      std::vector<SliceImage> images;
      for (int l = 0; l < static_cast<int>(shear.layers.size()); ++l)
        for (const auto& [k_begin, k_end] : slabs) {
          SliceImage image = image_of(l, k_begin, k_end, {0, 0, shear.width, shear.height}, 0);
          const Layer& layer = shear.layers[static_cast<size_t>(l)];
          for (int slice = layer.begin; slice < layer.end; ++slice) {
            const auto [first, last] = owned_pixels(grid, shear, slice, k_begin, k_end);
            for (int y = 0; y < shear.height; ++y)
              for (int x = 0; x < shear.width; ++x)
                if (const int at = shear.axis == 0 ? y : x; at >= first && at < last)
                  image.pixels[static_cast<size_t>(y * shear.width + x)] = 0xffffffffu;
          }
          images.push_back(std::move(image));
        }
      return testing::frame_of(grid, shear, images);
    };
    const auto display =
        looking_at(grid.centre_room(), orbit(grid, 0.93, 0.55 * n + 0.06, 0.4 * std::sin(n) + 0.03), 160, 120);
    testing::WarpedView whole(display), shared(display);
    const VolumeFrame one = frame_of_slabs({{0, 40}}), three = frame_of_slabs({{0, 17}, {17, 21}, {21, 40}});
    Warper(1).render(&one, display, 0, whole.target());
    Warper(1).render(&three, display, 0, shared.target());
    EXPECT_EQ(whole.colour, shared.colour) << n;
    EXPECT_GT(std::count(whole.colour.begin(), whole.colour.end(), 0xffffffffu), 1000) << n;
    ++shared_out;
  }
  EXPECT_GE(shared_out, 5);
}

}  // namespace
}  // namespace telesplat::volume
