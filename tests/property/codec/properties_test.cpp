// Properties of any image and any bytes, over many seeded ones, on every instruction set of this machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/codec/depth_codec.h"
#include "tests/support/codec/codec_images.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using image::DepthImage;

TEST(CodecProperties, RoundTrip) {
  for (uint32_t seed = 1; seed <= 8; ++seed)
    for (const DepthImage& image : test::codec_images(seed)) {
      ASSERT_TRUE(test::is_canonical(image));
      const auto back = decode(encode(image), image.width, image.height);
      ASSERT_TRUE(back.ok()) << back.error().text;
      ASSERT_TRUE(*back == image) << "seed " << seed << ", " << image.width << " x " << image.height;
    }
}

TEST(CodecProperties, RoundTripOfSeveralTiles) {
  for (const double density : {0.001, 0.02, 0.15, 0.7, 1.0}) {
    for (const auto& [width, height] :
         {std::pair{700, 300}, {513, 257}, {20, 9000}, {9000, 20}, {65536, 1}, {1, 65536}}) {
      DepthImage image = test::plane(width, height, 40, 90);
      test::keep_random(image, density, 3);
      const auto back = decode(encode(image));
      ASSERT_TRUE(back.ok()) << back.error().text;
      ASSERT_TRUE(*back == image) << density << ", " << width << " x " << height;
    }
  }
}

TEST(CodecProperties, EveryTruncationIsAnError) {
  for (const DepthImage& image : test::codec_images(1)) {
    const auto bytes = encode(image);
    for (size_t length = 0; length < bytes.size(); ++length) {
      const std::vector<uint8_t> part(
          bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(length));  // its own memory: overruns are seen
      ASSERT_FALSE(decode(part).ok()) << length << " of " << bytes.size();
    }
  }
}

TEST(CodecProperties, FlippedBitsGiveAnErrorOrACanonicalImage) {
  std::mt19937 random(11);
  size_t refused = 0, accepted = 0;
  for (uint32_t seed = 1; seed <= 5; ++seed)
    for (const DepthImage& image : test::codec_images(seed)) {
      const auto bytes = encode(image);
      for (int trial = 0; trial < 40; ++trial) {
        auto bad = bytes;
        for (uint32_t flips = 1 + random() % 3; flips > 0; --flips)
          bad[random() % bad.size()] ^= static_cast<uint8_t>(1u << random() % 8);
        const auto back = decode(bad);
        (back.ok() ? accepted : refused) += 1;
        if (!back.ok()) continue;
        ASSERT_TRUE(test::is_canonical(*back)) << "seed " << seed;
        ASSERT_TRUE(decode(encode(*back)).value() == *back) << "seed " << seed;
      }
    }
  EXPECT_GT(refused, accepted / 10);
  EXPECT_GT(accepted, 0u);
}

TEST(CodecProperties, RandomBytesAfterAGoodHeader) {
  std::mt19937 random(12);
  std::vector<uint8_t> mark = encode(test::random_pixels(1, 1, 1, 1));
  mark.resize(2);  // the mark and the version
  size_t accepted = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::vector<uint8_t> bytes = mark;
    bytes.push_back(random() % 4 == 0 ? 2 : 0);  // one tile
    for (int side = 0; side < 2; ++side) bytes.push_back(static_cast<uint8_t>(1 + random() % 100));
    for (uint32_t n = random() % 80; n > 0; --n)
      bytes.push_back(static_cast<uint8_t>(random() % (random() % 2 != 0 ? 256 : 16)));
    const auto image = decode(bytes);
    ASSERT_TRUE(!image.ok() || test::is_canonical(*image));
    accepted += image.ok();
  }
  EXPECT_GT(accepted, 0u) << "the header is good";
}

TEST(CodecProperties, ImagesOfAllWidthsComeBack) {
  // Widths around vector lengths, all densities: heads, bodies and tails of every kernel.
  std::vector<DepthImage> all;
  for (int width = 1; width <= 70; ++width) {
    all.push_back(test::render({.width = width, .height = 11, .seed = static_cast<uint32_t>(width), .rough = true}));
    all.push_back(test::random_pixels(width, 9, 1, static_cast<uint32_t>(width)));
    all.push_back(test::random_pixels(width, 9, 0.8, static_cast<uint32_t>(width)));
    all.push_back(test::random_pixels(width, 9, 0.05, static_cast<uint32_t>(width)));
  }
  for (const int width : {63, 64, 70}) all.push_back(test::facets(width, 90, static_cast<uint32_t>(width)));
  all.push_back(test::masked(test::facets(190, 180, 2), test::band_mask(190, 180, 30)));
  for (size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(decode(encode(all[i])).value() == all[i]) << "image " << i;
}

}  // namespace
}  // namespace telesplat::codec
