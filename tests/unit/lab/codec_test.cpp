// `telesplat-lab codec`: how many bits LZW takes, and the table of a set of images.
#include <gtest/gtest.h>

#include <random>

#include "common/codec/depth_codec.h"
#include "tests/support/depth_images.h"
#include "tools/lab/codec/lzw.h"
#include "tools/lab/codec/measure.h"

namespace telesplat::lab {
namespace {

using Bytes = std::vector<uint8_t>;

TEST(Lzw, CountsAsTheSpecificationDoes) {
  // Its example: 7 7 7 8 8 7 7 6 6 becomes clear 7 258 8 8 258 6 6 end.
  EXPECT_EQ(lzw_bits(Bytes{7, 7, 7, 8, 8, 7, 7, 6, 6}), 9u * 9);
  EXPECT_EQ(lzw_bits(Bytes{}), 9u * 2);
  EXPECT_EQ(lzw_bits(Bytes{1}), 9u * 3);
}

TEST(Lzw, EqualBytesBecomeEverLongerStrings) {
  // 1 + 2 + ... + n bytes are n codes.
  EXPECT_EQ(lzw_bits(Bytes(5 * 6 / 2, 3)), 9u * (5 + 2));
  // The 254th code is the last one of 9 bits: entry 511 is added after it.
  EXPECT_EQ(lzw_bits(Bytes(253 * 254 / 2, 3)), 9u * (1 + 253) + 9);
  EXPECT_EQ(lzw_bits(Bytes(254 * 255 / 2, 3)), 9u * (1 + 254) + 10);
  EXPECT_EQ(lzw_bits(Bytes(256 * 257 / 2, 3)), 9u * (1 + 254) + 10 * 2 + 10);
}

TEST(Lzw, ClearsATableThatIsFull) {
  std::mt19937 random(1);
  Bytes noise(100'000);
  for (uint8_t& b : noise) b = uint8_t(random());
  const double bits = double(lzw_bits(noise)) / double(noise.size());
  EXPECT_GT(bits, 10);  // two bytes in a row are seldom seen twice before the table is cleared
  EXPECT_LT(bits, 12);
}

TEST(CodecFigures, AddUpToTheStreamsOfTheTiles) {
  const auto image = test::render({.width = 600, .height = 300});
  CodecFigures figures{"made"};
  ASSERT_TRUE(add(image, figures));
  size_t bits = 0;
  for (int y = 0; y < image.height; y += 256)
    for (int x = 0; x < image.width; x += 256)
      bits +=
          8 * codec::encode(test::crop(image, x, y, std::min(256, image.width - x), std::min(256, image.height - y)))
                  .size();
  EXPECT_EQ(figures.bits, bits);
  EXPECT_EQ(figures.images, 1u);
  EXPECT_EQ(figures.tiles, 6u);
  EXPECT_LT(figures.bits, figures.lzw_bits);
  EXPECT_LT(figures.bits, figures.zstd_bits);
  EXPECT_GT(figures.encode_s, 0);
  EXPECT_GT(figures.decode_s, 0);
  EXPECT_NE(to_markdown({figures}).find("| made | 1 | 6 |"), std::string::npos) << to_markdown({figures});
}

TEST(CodecFigures, OfAnEmptyImageAreZero) {
  CodecFigures figures;
  ASSERT_TRUE(add(image::DepthImage(300, 20), figures));
  EXPECT_EQ(figures.tiles, 0u);
  EXPECT_NE(to_markdown({figures}).find("| 0.000 |"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::lab
