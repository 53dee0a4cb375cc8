// Backgrounds, and coverage of pixels.
#include <gtest/gtest.h>

#include "common/image/background.h"

namespace telesplat::image {
namespace {

uint32_t over(uint32_t colour, double alpha, uint32_t background) {
  uint32_t out = 0;
  for (const int shift : {0, 8, 16})
    out |= uint32_t((colour >> shift & 255) * alpha + (background >> shift & 255) * (1 - alpha) + 0.5) << shift;
  return out;
}

TEST(Background, NamesAndNumbers) {
  EXPECT_EQ(parse_background("white")->colour, 0xffffffu);
  EXPECT_EQ(parse_background("grey")->colour, parse_background("gray")->colour);
  EXPECT_EQ(parse_background("#0a1B2c")->colour, 0x0a1b2cu);
  EXPECT_TRUE(parse_background("transparent")->transparent);
  for (const char* bad : {"", "#12345", "#1234567", "#12345g", "0x123456", "#-12345", "# 12345", "White "})
    EXPECT_FALSE(parse_background(bad).ok()) << bad;
}

TEST(Background, CoverageIsWhatDoesNotShineThrough) {
  View black{5, 1, {}, {}}, white = black;
  const std::pair<uint32_t, double> pixels[] = {
      {0x808080, 0}, {0x336699, 1}, {0xff8000, 0.5}, {0xffffff, 0.25}, {0x000000, 0.75}};
  for (const auto& [colour, alpha] : pixels) {
    black.colour.push_back(over(colour, alpha, 0) | 0xff000000u);
    white.colour.push_back(over(colour, alpha, 0xffffff) | 0xff000000u);
  }
  find_coverage(white, black);
  for (size_t i = 0; i < 5; ++i) {
    const uint32_t straight = straight_colour(black.colour[i]);
    EXPECT_NEAR(straight >> 24, 255 * pixels[i].second, 1.01) << i;
    if (pixels[i].second == 0) continue;
    for (const int shift : {0, 8, 16})
      EXPECT_NEAR(int(straight >> shift & 255), int(pixels[i].first >> shift & 255), 3) << i;
  }
}

}  // namespace
}  // namespace telesplat::image
