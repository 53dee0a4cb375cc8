#include "common/image/legend.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/image/glyphs.h"

namespace telesplat::image {
namespace {

std::vector<std::string> labels(double lo, double hi, int most = 6) {
  std::vector<std::string> out;
  for (const auto& tick : nice_ticks(lo, hi, most).all) out.push_back(tick.label);
  return out;
}
using Labels = std::vector<std::string>;

Legend some_legend() { return {"temperature [K]", 273.2, 301.7, *colour::find_colour_map("viridis"), {}}; }

TEST(NiceTicks, AreRoundNumbersWithinTheRange) {
  EXPECT_EQ(labels(0, 1), (Labels{"0.0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(labels(273.2, 301.7), (Labels{"275", "280", "285", "290", "295", "300"}));
  EXPECT_EQ(labels(-3, 7.2, 4), (Labels{"-2.5", "0.0", "2.5", "5.0"}));
  EXPECT_EQ(labels(-1, 1, 5), (Labels{"-1.0", "-0.5", "0.0", "0.5", "1.0"})) << "no minus zero";
  EXPECT_EQ(labels(-1024, 3071), (Labels{"-1000", "0", "1000", "2000", "3000"}));
  EXPECT_EQ(labels(4, 4), (Labels{"4"})) << "an array of one value";
  EXPECT_EQ(labels(0, 0), (Labels{"0"}));
}

TEST(NiceTicks, VeryLargeAndSmallNumbersShareAPowerOfTen) {
  const Ticks large = nice_ticks(0, 3.1e8, 6);
  EXPECT_EQ(large.exponent, 8);
  EXPECT_EQ(large.all.back().label, "3");
  EXPECT_DOUBLE_EQ(large.all.back().value, 3e8);
  const Ticks small = nice_ticks(-2e-7, 2e-7, 6);
  EXPECT_EQ(small.exponent, -7);
  EXPECT_EQ(small.all.front().label, "-2");
  EXPECT_EQ(nice_ticks(2459000, 2459010, 6).exponent, 0) << "dates stay whole";
}

TEST(NiceTicks, HoldForAnyRange) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> mantissa(-10, 10), power(-300, 299);
  for (int n = 0; n < 20000; ++n) {
    double lo = mantissa(random) * std::pow(10.0, std::floor(power(random)));
    double hi = n % 3 ? lo + std::abs(mantissa(random)) * std::pow(10.0, std::floor(power(random)))
                      : lo + std::abs(lo) * std::abs(mantissa(random)) * 1e-6;
    const int most = 2 + n % 9;
    const Ticks ticks = nice_ticks(lo, hi, most);
    ASSERT_GE(ticks.all.size(), hi - lo > 1e-12 * std::abs(lo) ? 2u : 1u) << lo << " " << hi;
    ASSERT_LE(int(ticks.all.size()), most) << lo << " " << hi;
    for (size_t i = 0; i < ticks.all.size(); ++i) {
      ASSERT_GE(ticks.all[i].value, lo);
      ASSERT_LE(ticks.all[i].value, hi);
      ASSERT_LE(ticks.all[i].label.size(), 24u) << lo << " " << hi;
      if (i > 0) {
        ASSERT_GT(ticks.all[i].value, ticks.all[i - 1].value) << lo << " " << hi;
      }
    }
  }
  EXPECT_EQ(nice_ticks(-1e300, 1e300, 6).exponent, 300);
}

TEST(LegendPicture, TheBarHasTheMapsColoursLowBelow) {
  const Legend legend = some_legend();
  View picture{1280, 800, std::vector<uint32_t>(1280 * 800, 0x808080), {}};
  draw_legend(picture, legend);
  // Finds the bar's column by its ends' colours, the low one below the high one.
  int low = -1, high = -1;
  for (int y = 0; y < 800; ++y)
    for (int x = 640; x < 1280; ++x) {
      const uint32_t c = picture.colour[size_t(y) * 1280 + x] & 0xffffff;  // the upper byte has the coverage
      if (c == legend.map.at(0)) low = y;
      if (c == legend.map.at(1) && high < 0) high = y;
    }
  ASSERT_GT(high, 400);
  EXPECT_GT(low, high + 250) << "two fifths of the picture's height";
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 1280; ++x) ASSERT_EQ(picture.colour[size_t(y) * 1280 + x], 0x808080u) << x << "," << y;
}

TEST(LegendPicture, ReadsOnAnyGround) {
  for (const uint32_t ground : {0x000000u, 0xffffffu, 0x808080u}) {
    View picture{640, 400, std::vector<uint32_t>(640 * 400, ground), {}};
    draw_legend(picture, some_legend());
    int light = 0, dark = 0;
    for (const uint32_t c : picture.colour) light += (c >> 8 & 255) > 230, dark += (c >> 8 & 255) < 70;
    EXPECT_GT(light, 300) << "letters on " << ground;
    EXPECT_GT(dark, 300) << "their rims on " << ground;
    const View legend = legend_picture(some_legend(), 640, 400);
    const auto place = legend_place(legend, 640, 400);
    EXPECT_LT(picture.colour[size_t(place.y) * 640 + place.x] >> 8 & 255, 120u) << "the plate on " << ground;
  }
}

TEST(LegendPicture, GrowsWithTheDisplayAndStaysInside) {
  int before = 0;
  for (const auto& [width, height] : {std::pair{320, 200}, {640, 400}, {1280, 800}, {2560, 1600}, {7680, 4320}}) {
    const View picture = legend_picture(some_legend(), width, height);
    EXPECT_GT(picture.height, before);
    before = picture.height;
    const auto place = legend_place(picture, width, height);
    EXPECT_GE(place.x, width / 2);
    EXPECT_GE(place.y, 0);
    EXPECT_LE(place.x + place.width, width);
    EXPECT_LE(place.y + place.height, height);
  }
  View tiny{7, 5, std::vector<uint32_t>(35, 0), {}};
  draw_legend(tiny, some_legend());  // it has no room and is cut off
  EXPECT_EQ(tiny.colour.size(), 35u);
}

TEST(LegendPicture, LongTitlesWrapAndEnd) {
  Legend legend = some_legend();
  const int narrow = legend_picture(legend, 640, 400).width;
  for (int n = 0; n < 200; ++n) legend.title += " and more";
  legend.title += std::string(500, 'x');
  const View picture = legend_picture(legend, 640, 400);
  EXPECT_LT(picture.width, 640 / 3 + 20);
  EXPECT_GE(picture.width, narrow);
  EXPECT_LT(picture.height, 400);
}

TEST(LegendPicture, OpacityIsTheHeightOfTheCurve) {
  Legend legend = some_legend();
  legend.map = *colour::find_colour_map("grey");
  legend.map.stops = {{0, 0xff0000}, {1, 0xff0000}};
  legend.opacity = {0, 1};
  const View picture = legend_picture(legend, 1280, 800);
  std::vector<int> filled;
  for (int y = 0; y < picture.height; ++y) {
    int n = 0;
    for (int x = 0; x < picture.width; ++x) n += picture.colour[size_t(y) * picture.width + x] == 0xffff0000;
    filled.push_back(n);
  }
  EXPECT_EQ(*std::max_element(filled.begin(), filled.end()), 48) << "all of the bar's width, where opacity is 1";
  const auto first = std::find_if(filled.begin(), filled.end(), [](int n) { return n > 0; }) - filled.begin();
  EXPECT_EQ(filled[size_t(first)], 48) << "at the top";
  EXPECT_NEAR(filled[size_t(first) + 160], 24, 1) << "half way down";
}

TEST(Legend, TextsComeBackAsTheSameLegend) {
  Legend legend = some_legend();
  EXPECT_EQ(*legend_from_text(to_text(legend)), legend);
  legend.opacity = {0, 0.25f, 1.0f / 3};
  legend.title = "\u00b5m = [\u00b0C]";
  EXPECT_EQ(*legend_from_text(to_text(legend)), legend);
  legend.title = "two\nlines";
  EXPECT_EQ(legend_from_text(to_text(legend))->title, "two lines");
  for (const char* bad : {"", "t", "t\n1\n", "t\n1\n0\nviridis\n", "t\nnan\n1\nviridis\n", "t\n0\ninf\nviridis\n",
                          "t\n0\n1\nnothing\n", "t\n0\n1\nviridis\n2 ", "t\n0\n1\nviridis\n0 x "})
    EXPECT_FALSE(legend_from_text(bad)) << bad;
  EXPECT_FALSE(legend_from_text("t\n0\n1\nviridis\n" + std::string(30000, ' ')));
}

TEST(Glyphs, SignsOfUnitsAreKnownAndTextIsCutByCharacters) {
  EXPECT_EQ(text_width("\u00b0C", 1), text_width("xC", 1));
  const Glyph box = glyph_of(U'\u4e2d');
  for (const char32_t c : {U'\u00b0', U'\u00b5', U'\u00b2', U'\u00b3', U'\u03a9', U'\u00c5', U'\u00d7'})
    EXPECT_NE(glyph_of(c), box);
  std::string_view broken = "\xc3\xff\xe2\x82";
  EXPECT_EQ(take_character(broken), 0xfffdu);
  EXPECT_EQ(take_character(broken), 0xfffdu);
  EXPECT_EQ(take_character(broken), 0xfffdu);
  EXPECT_TRUE(broken.empty());
}

}  // namespace
}  // namespace telesplat::image
