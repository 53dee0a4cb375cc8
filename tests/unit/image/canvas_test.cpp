#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "common/image/canvas.h"
#include "common/image/glyphs.h"

namespace telesplat::image {
namespace {

View numbered(int width, int height) {
  View v{width, height, std::vector<uint32_t>(size_t(width) * height), {}};
  for (size_t i = 0; i < v.colour.size(); ++i) v.colour[i] = uint32_t(i + 1);
  return v;
}

int count(const View& v, uint32_t colour) { return int(std::count(v.colour.begin(), v.colour.end(), colour)); }

TEST(Glyphs, EveryLetterIsDifferentAndFits) {
  std::set<Glyph> seen;
  for (int c = ' '; c <= '~'; ++c) {
    const Glyph& g = glyph_of(char(c));
    EXPECT_TRUE(seen.insert(g).second) << "'" << char(c) << "' looks like another letter";
    for (const uint8_t row : g) EXPECT_LT(row, 1 << kGlyphWidth);
  }
  for (const char c : {'\n', '\x7f', '\xc3', '\0'}) EXPECT_FALSE(seen.contains(glyph_of(c)));
}

TEST(Canvas, WritesTextWithinItsWidth) {
  Canvas canvas(200, 40, 0x101010);
  canvas.text(10, 5, "PSNR 31.2", 0xffffff, 2);
  const int width = text_width("PSNR 31.2", 2);
  EXPECT_EQ(width, (9 * kGlyphAdvance - 1) * 2);
  EXPECT_GT(count(canvas.view(), 0xffffff), 100);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 200; ++x)
      if (x < 10 || x >= 10 + width || y < 5 || y >= 5 + 2 * kGlyphHeight) {
        ASSERT_EQ(canvas.view().colour[size_t(y) * 200 + x], 0x101010u);
      }
  EXPECT_EQ(text_width("", 3), 0);
}

TEST(Canvas, CutsOffWhatLiesOutside) {
  Canvas canvas(20, 10, 0);
  canvas.place(numbered(4, 3), -1, -1);
  EXPECT_EQ(canvas.view().colour[0], 6u);  // second row, second column
  EXPECT_EQ(canvas.view().colour[20 + 2], 12u);
  canvas.place(numbered(4, 3), 18, 8);
  EXPECT_EQ(canvas.view().colour[8 * 20 + 18], 1u);
  EXPECT_EQ(canvas.view().colour[9 * 20 + 19], 6u);
  canvas.place(numbered(4, 3), 100, 3);
  canvas.place(numbered(4, 3), 3, -50);
  canvas.text(-7, -3, "everything that is too long", 0x555555, 3);
  canvas.outline({-5, -5, 100, 100}, 0x666666);
  EXPECT_EQ(canvas.view().colour.size(), 200u);
  EXPECT_EQ(count(canvas.view(), 0x666666), 0);
  canvas.outline({2, 2, 5, 4}, 0x777777);
  EXPECT_EQ(count(canvas.view(), 0x777777), 2 * 5 + 2 * 2);
}

TEST(Shrink, TakesMeansOfAreas) {
  View v{4, 2, {0x000000, 0x0000ff, 0x00ff00, 0x00ff00, 0x000000, 0x0000ff, 0x00ff00, 0xff0000}, {}};
  const View half = shrink(v, 2, 1);
  EXPECT_EQ(half.colour[0], 0x000080u);
  EXPECT_EQ(half.colour[1], 0x40bf00u);
  EXPECT_EQ(shrink(v, 4, 2).colour, v.colour);
  // 3 -> 2: each takes one pixel and half of the middle one.
  const View row{3, 1, {0x000000, 0x000060, 0x0000ff}, {}};
  EXPECT_EQ(shrink(row, 2, 1).colour, (std::vector<uint32_t>{0x000020, 0x0000ca}));
  std::mt19937 random(2);
  View grey{97, 61, {}, {}};
  double sum = 0, shrunk = 0;
  for (int i = 0; i < 97 * 61; ++i) sum += double(grey.colour.emplace_back(random() % 256));
  const View small = shrink(grey, 13, 11);
  for (const uint32_t c : small.colour) shrunk += c;
  EXPECT_NEAR(shrunk / (13 * 11), sum / (97 * 61), 0.6);
}

TEST(Magnify, RepeatsPixels) {
  const View v = magnify(numbered(5, 4), {2, 1, 2, 3}, 3);
  ASSERT_EQ(v.width, 6);
  ASSERT_EQ(v.height, 9);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 6; ++x) EXPECT_EQ(v.colour[size_t(y) * 6 + x], uint32_t((1 + y / 3) * 5 + 2 + x / 3 + 1));
}

TEST(WorstSquare, IsTheOneWithTheLargestSum) {
  std::mt19937 random(9);
  for (int round = 0; round < 50; ++round) {
    const int width = 3 + int(random() % 30), height = 3 + int(random() % 20), side = 1 + int(random() % 12);
    std::vector<float> errors(size_t(width) * height);
    for (float& e : errors) e = float(random() % 100) / 100;
    const auto found = worst_square(errors, width, height, side);
    const int w = std::min(side, width), h = std::min(side, height);
    ASSERT_EQ(found.width, w);
    ASSERT_EQ(found.height, h);
    const auto sum_at = [&](int x, int y) {
      double sum = 0;
      for (int v = y; v < y + h; ++v)
        for (int u = x; u < x + w; ++u) sum += errors[size_t(v) * width + u];
      return sum;
    };
    double most = 0;
    for (int y = 0; y + h <= height; ++y)
      for (int x = 0; x + w <= width; ++x) most = std::max(most, sum_at(x, y));
    ASSERT_NEAR(sum_at(found.x, found.y), most, 1e-4);
  }
  EXPECT_EQ(worst_square(std::vector<float>(100, 0.0f), 10, 10, 4), (geometry::Rect{0, 0, 4, 4}));
}

}  // namespace
}  // namespace telesplat::image
