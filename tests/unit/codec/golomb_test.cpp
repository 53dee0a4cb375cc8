// Codes of residuals: any comes back whatever was expected, and no bits take more than is promised. A sparse tile costs
// no more than sparse tiles do.
#include "common/codec/golomb.h"

#include <gtest/gtest.h>

#include <random>

#include "common/codec/depth_codec.h"
#include "common/codec/walk.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using detail::GolombContext;

constexpr int kMost = (1 << 24) - 1;

TEST(Golomb, AnyResidualComesBackWhateverWasExpected) {
  std::mt19937 random(4);
  for (int size = 0; size <= 24; ++size) {
    std::vector<int> residuals{0, -1, 1, kMost, -kMost, kMost, kMost, -kMost, 0, 0};
    for (int i = 0; i < 1000; ++i) residuals.push_back(static_cast<int>(random() >> (8 + random() % 24)) - (1 << 12));
    detail::BitWriter writer;
    writer.start(residuals.size() * GolombContext::kMostBits);
    GolombContext put, get;
    put.start(1u << size), get.start(1u << size);
    for (const int r : residuals) put.put(r, writer.sink);
    detail::BitReader reader;
    reader.start(writer.bytes(), GolombContext::kMostBits);
    for (const int r : residuals) ASSERT_EQ(get.get(reader.source), r) << size;
    EXPECT_TRUE(reader.finished());
  }
}

// What is as large as it was expected to be takes as many bits as that, and few more.
TEST(Golomb, WhatIsExpectedIsShort) {
  for (int size = 1; size <= 24; ++size) {
    detail::BitWriter writer;
    writer.start(GolombContext::kMostBits);
    GolombContext context;
    context.start(1u << size);
    context.put((1 << size) - 1, writer.sink);
    EXPECT_LE(8 * writer.bytes().size(), size_t(size) + 12) << size;
  }
}

TEST(Golomb, NoBitsTakeMoreThanIsPromised) {
  std::mt19937 random(5);
  std::vector<uint8_t> ones(1 << 12, 0xff), noise(1 << 12);
  for (uint8_t& b : noise) b = static_cast<uint8_t>(random() | random());
  for (const auto& bytes : {ones, noise})
    for (int size = 0; size <= 24; ++size) {
      detail::BitReader reader;
      reader.start(bytes, GolombContext::kMostBits);
      GolombContext context;
      context.start(1u << size);
      while (!reader.overrun()) {
        const size_t before = reader.source.position;
        const int residual = context.get(reader.source);
        ASSERT_LE(reader.source.position - before, size_t{GolombContext::kMostBits}) << size;
        ASSERT_LT(std::abs(residual), 1 << 25);
      }
    }
}

// A tile whose pixels `mask` covers, coded as a sparse one.
std::vector<uint8_t> as_sparse(const image::DepthImage& image, const image::PixelMask& mask) {
  const detail::TileRect rect{0, static_cast<size_t>(image.width), image.width, image.height};
  std::vector<uint8_t> out{0xD7, 5, 0, static_cast<uint8_t>(image.width), static_cast<uint8_t>(image.height), 2 | 4};
  out.resize(out.size() + 8);  // the first prediction: none
  out[6] = 1;
  detail::put_mask(out, mask);
  detail::TileScratch s;
  s.mask = mask;
  const detail::TileBounds exact({});
  s.scatter_encoder.start(mask.count(), exact);
  encode_sparse(s, image, rect, {1, 0, 0}, detail::kRaw);
  s.scatter_encoder.finish(out);
  return out;
}

TEST(Scatter, DenseTilesAreNoSparseOnes) {
  for (const double density : {0.2, 0.3, 0.6}) {
    const image::PixelMask mask = test::random_mask(100, 100, density, 3);
    image::DepthImage image = test::random_pixels(100, 100, 1, 7);
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x)
        if (!mask.at(x, y)) {
          const auto i = static_cast<size_t>(100 * y + x);
          image.depth[i] = 0, image.colour[i] = 0, image.normal[i] = 0;
        }
    const auto back = decode(as_sparse(image, mask));
    ASSERT_EQ(back.ok(), density < 0.25) << density;
    if (back.ok()) {
      EXPECT_EQ(*back, image);
    }
  }
}

}  // namespace
}  // namespace telesplat::codec
