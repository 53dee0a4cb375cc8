// Sparse tiles: their size where it can be computed, and no dense tile is coded as a sparse one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/codec/depth_codec.h"
#include "common/codec/poles.h"
#include "common/codec/tile.h"
#include "common/image/normal.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

// Codes a tile with the pixels of `mask` as a sparse one.
std::vector<uint8_t> as_sparse(const image::DepthImage& image, const image::PixelMask& mask) {
  const detail::TileRect rect{0, static_cast<size_t>(image.width), image.width, image.height};
  std::vector<uint8_t> out{0xD7, 12, 0, static_cast<uint8_t>(image.width), static_cast<uint8_t>(image.height), 2 | 4};
  out.resize(out.size() + 8);  // the first prediction: 0
  out[6] = 1;
  detail::put_mask(out, mask);
  out.push_back(detail::kRaw);
  detail::TileScratch s;
  s.mask = mask;
  const detail::TileBounds exact({});
  s.scatter_encoder.start(exact, nullptr);
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

// 2000 scattered pixels of level ground, with normals around a direction and colours by pixel.
template <class Colour>
image::DepthImage scattered(double x, double y, double z, Colour colour_of) {
  const image::PixelMask mask = test::random_mask(256, 256, 2000.0 / 65536, 5);
  image::DepthImage image(256, 256);
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0, 0.03);
  for (int row = 0; row < 256; ++row)
    for (int column = 0; column < 256; ++column) {
      if (!mask.at(column, row)) continue;
      const auto i = static_cast<size_t>(256 * row + column);
      image.depth[i] = static_cast<uint32_t>(1000000 + 300 * row + 20 * column);
      image.colour[i] = colour_of(random);
      const auto of = [&](double v) { return static_cast<float>(v + noise(random)); };
      image.normal[i] = image::encode_normal16(glm::normalize(glm::vec3(of(x), of(y), of(z))));
    }
  return image;
}
constexpr auto kGrey = [](auto&) { return 0x808080u; };

// Level ground lies on the seam of the octahedral map.
TEST(Scatter, NormalsAtTheSeamCostNoMoreThanElsewhere) {
  const auto at_pole = encode(scattered(0, 0, 1, kGrey)), at_seam = encode(scattered(0, 0, -1, kGrey)),
             beside = encode(scattered(0, 1, 0, kGrey));
  EXPECT_LT(at_seam.size(), at_pole.size() * 102 / 100);
  EXPECT_LT(beside.size(), at_pole.size() * 102 / 100);
}

TEST(Scatter, NormalsThatAreNotCanonicalComeBack) {
  image::DepthImage image = scattered(0, 0, -1, kGrey);
  size_t others = 0;
  for (size_t i = 0; i < image.pixels(); ++i)
    if (image.depth[i] != 0 && i % 3 == 0) {
      image.normal[i] = static_cast<uint16_t>(254 << 8 | i % 255);  // on the map's rim, which is folded onto itself
      others += image::canonical_normal16(image.normal[i]) != image.normal[i];
    }
  ASSERT_GT(others, 10u);
  EXPECT_EQ(decode(encode(image)).value(), image);
}

// Pixels that a viewer lacks lie all over its view. With its own base, mask, tables and end a tile takes 20 bytes.
TEST(OneTile, IsWhatScatteredPixelsOfALargeImageAre) {
  image::DepthImage image = test::render({.width = 700, .height = 500, .seed = 4});
  test::keep_random(image, 0.002, 5);
  const auto whole = encode(image);
  EXPECT_EQ(whole[2], 2) << "the flag";
  EXPECT_EQ(decode(whole).value(), image);
  const auto info = inspect(whole);
  ASSERT_TRUE(info.ok());
  EXPECT_EQ(info->covered_pixels, size_t(std::ranges::count_if(image.depth, [](uint32_t d) { return d != 0; })));
  size_t apart = 0;
  for (int y = 0; y < 500; y += 250)
    for (int x = 0; x < 700; x += 234) apart += encode(test::crop(image, x, y, std::min(234, 700 - x), 250)).size();
  EXPECT_LT(whole.size() + 100, apart);

  image::DepthImage known;
  const ErrorBounds bounds{209715, 1, 1};
  const auto bounded = encode(image, bounds, &known);
  EXPECT_EQ(bounded[2], 3) << "the flags";
  EXPECT_LT(bounded.size(), whole.size());
  EXPECT_EQ(decode_refinement(encode_refinement(image, known), known).value(), image);
}

TEST(OneTile, IsNoImageOfWhichAPartIsDense) {
  image::DepthImage image = test::render({.width = 600, .height = 300, .seed = 4});
  image::DepthImage scattered = image;
  test::keep_random(scattered, 0.002, 5);
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 600; ++x) {
      const auto i = static_cast<size_t>(600 * y + x);
      if (x < 150 && y < 100) continue;
      image.depth[i] = scattered.depth[i], image.colour[i] = scattered.colour[i], image.normal[i] = scattered.normal[i];
    }
  const auto bytes = encode(image);
  EXPECT_EQ(bytes[2], 0);
  EXPECT_EQ(decode(bytes).value(), image);
}

// A walk distinguishes at most 65535 pixels.
TEST(OneTile, HasNoMorePixelsThanAWalkTellsApart) {
  for (const double density : {0.0150, 0.0165}) {
    image::DepthImage image = test::random_pixels(2048, 2048, density, 9);
    const auto count = std::ranges::count_if(image.depth, [](uint32_t d) { return d != 0; });
    const auto bytes = encode(image);
    EXPECT_EQ(bytes[2], count <= 65535 ? 2 : 0) << count;
    EXPECT_EQ(decode(bytes).value(), image);
  }
}

TEST(OneTile, IsSparseOrRefused) {
  image::DepthImage image = test::render({.width = 300, .height = 256, .seed = 4});
  auto dense = encode(image);
  ASSERT_EQ(dense[2], 0);
  dense[2] = 2;
  EXPECT_FALSE(decode(dense).ok());
  test::keep_random(image, 0.002, 5);
  auto sparse = encode(image);
  ASSERT_EQ(sparse[2], 2);
  for (size_t n = 0; n < sparse.size(); ++n) EXPECT_FALSE(decode(std::span(sparse).first(n)).ok()) << n;
  sparse[2] = 0;
  EXPECT_FALSE(decode(sparse).ok()) << "of two tiles";
}

// Once a green has been seen, a ramp's other channels follow from it.
TEST(Scatter, AColourWhoseGreenWasSeenCostsItsGreen) {
  const auto ramp = encode(scattered(0, 0, 1, [](auto& random) {
    const uint32_t g = random() % 64 * 4;
    return (g * g / 256) << 16 | g << 8 | (255 - g);
  }));
  const auto any = encode(scattered(0, 0, 1, [](auto& random) {
    const uint32_t g = random() % 64 * 4;
    return (random() % 256) << 16 | g << 8 | random() % 256;
  }));
  const auto grey = encode(scattered(0, 0, 1, kGrey));
  const double pixels = 2000;
  EXPECT_LT(8 * static_cast<double>(ramp.size() - grey.size()) / pixels, 10.5) << "64 of them are random: 6 bits";
  EXPECT_GT(8 * static_cast<double>(any.size() - grey.size()) / pixels, 20);
}

}  // namespace
}  // namespace telesplat::codec
