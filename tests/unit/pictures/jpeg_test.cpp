// JPEG pictures: round trips, and bytes that are refused.
#include "common/image/jpeg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace telesplat::image {
namespace {

// Soft colours: JPEG changes them little.
std::vector<uint32_t> ramp(int width, int height) {
  std::vector<uint32_t> out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      out.push_back(uint32_t(40 + 2 * x) << 16 | uint32_t(60 + 2 * y) << 8 | uint32_t(128 + x - y));
  return out;
}

int worst(const std::vector<uint32_t>& a, const std::vector<uint32_t>& b) {
  int out = 0;
  for (size_t i = 0; i < a.size(); ++i)
    for (const int shift : {0, 8, 16})
      out = std::max(out, std::abs(int(a[i] >> shift & 255) - int(b[i] >> shift & 255)));
  return out;
}

TEST(Jpeg, ColoursComeBackTheBetterTheHigherTheQuality) {
  const auto colour = ramp(70, 50);
  std::vector<uint32_t> low(colour.size()), high(colour.size());
  const auto coarse = encode_jpeg(colour, 70, 50, 30), fine = encode_jpeg(colour, 70, 50, 100);
  ASSERT_TRUE(decode_jpeg(coarse, 70, 50, low.data(), 70));
  ASSERT_TRUE(decode_jpeg(fine, 70, 50, high.data(), 70));
  EXPECT_LT(coarse.size(), fine.size());
  EXPECT_LE(worst(colour, high), 3);
  EXPECT_LE(worst(colour, low), 40);
  EXPECT_GT(worst(colour, low), worst(colour, high));
}

TEST(Jpeg, ATileIsDecodedIntoItsPlace) {
  const std::vector<uint32_t> red(16 * 8, 0xff0000);
  std::vector<uint32_t> picture(40 * 30, 0x010203);
  ASSERT_TRUE(decode_jpeg(encode_jpeg(red, 16, 8, 100), 16, 8, &picture[10 * 40 + 20], 40));
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      const uint32_t c = picture[size_t(y * 40 + x)] & 0xffffff;
      if (x >= 20 && x < 36 && y >= 10 && y < 18)
        EXPECT_GE(c >> 16, 0xfdu) << x << " " << y;
      else
        EXPECT_EQ(c, 0x010203u) << x << " " << y;
    }
}

TEST(Jpeg, WhatIsCutOffDamagedOrOfAnotherSizeIsRefused) {
  const auto colour = ramp(33, 21);
  const auto jpeg = encode_jpeg(colour, 33, 21, 80);
  std::vector<uint32_t> to(colour.size());
  for (size_t size = 0; size < jpeg.size() - 2; ++size)
    EXPECT_FALSE(decode_jpeg(std::span(jpeg).first(size), 33, 21, to.data(), 33)) << size << " bytes";
  const auto other = decode_jpeg(jpeg, 32, 21, to.data(), 33);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().text.find("33x21 pixels instead of 32x21"), std::string::npos) << other.error().text;
  EXPECT_TRUE(decode_jpeg(jpeg, 33, 21, to.data(), 33)) << "errors leave nothing behind";
}

}  // namespace
}  // namespace telesplat::image
