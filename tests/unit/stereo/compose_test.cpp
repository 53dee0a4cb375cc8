// Two pictures on one display, side by side in place or mixed by colour.
#include <gtest/gtest.h>

#include "client/stereo/compose.h"
#include "client/stereo/pattern.h"

namespace telesplat::stereo {
namespace {

// Every pixel encodes its eye, column and row.
image::View picture(uint32_t eye, int width, int height) {
  image::View v{width, height, {}, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      v.colour.push_back(eye << 16 | uint32_t(y) << 8 | uint32_t(x));
      v.depth_m.push_back(float(eye) + float(x) * 0.01f);
    }
  return v;
}

uint32_t eye_at(const image::View& v, int x, int y) { return v.colour[size_t(y) * size_t(v.width) + size_t(x)] >> 16; }
uint32_t place_at(const image::View& v, int x, int y) {
  return v.colour[size_t(y) * size_t(v.width) + size_t(x)] & 0xffff;
}

image::View composed(Mode mode, int width = 6, int height = 4) {
  image::View out;
  compose(mode, picture(1, width, height), picture(2, width, height), out);
  return out;
}

TEST(StereoModes, NamesLeadToModesAndBack) {
  for (const auto& name : mode_names()) EXPECT_EQ(name_of(*mode_named(name)), name);
  EXPECT_FALSE(mode_named("stereo"));
  EXPECT_EQ(mode_named("checker"), Mode::kChecker);
  EXPECT_EQ(mode_named("autostereo"), Mode::kAutostereo);
}

TEST(StereoModes, SizesFitTheDisplay) {
  const Size display{1281, 801};
  for (const auto& name : mode_names()) {
    const Mode mode = *mode_named(name);
    const Size eye = eye_size(mode, display);
    if (mode == Mode::kQuadBuffer) {  // a buffer for each eye
      EXPECT_EQ(eye, display);
      EXPECT_EQ(composed_size(mode, eye), (Size{2 * display.width, display.height}));
      continue;
    }
    const Size both = composed_size(mode, eye);
    EXPECT_LE(both.width, display.width) << name;
    EXPECT_GE(both.width, display.width - 1) << name;
    EXPECT_LE(both.height, display.height) << name;
    EXPECT_GE(both.height, display.height - 1) << name;
  }
  EXPECT_EQ(eye_size(Mode::kSideBySide, {2560, 800}), (Size{1280, 800}));
  EXPECT_EQ(eye_size(Mode::kTopBottom, {1280, 1600}), (Size{1280, 800}));
  EXPECT_EQ(eye_size(Mode::kSideBySideHalf, {1280, 800}), (Size{1280, 800}));
}

TEST(StereoCompose, PicturesLieBesideOrAboveEachOther) {
  const auto beside = composed(Mode::kSideBySide), above = composed(Mode::kTopBottom);
  ASSERT_EQ(beside.width, 12);
  ASSERT_EQ(above.height, 8);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) {
      EXPECT_EQ(eye_at(beside, x, y), 1u);
      EXPECT_EQ(eye_at(beside, 6 + x, y), 2u);
      EXPECT_EQ(place_at(beside, 6 + x, y), uint32_t(y << 8 | x));
      EXPECT_EQ(eye_at(above, x, y), 1u);
      EXPECT_EQ(eye_at(above, x, 4 + y), 2u);
      EXPECT_EQ(place_at(above, x, 4 + y), uint32_t(y << 8 | x));
    }
  EXPECT_FLOAT_EQ(beside.depth_m[7], 2.01f);
  EXPECT_EQ(composed(Mode::kQuadBuffer).colour, beside.colour);
}

TEST(StereoCompose, HalvesAreMeansOfPairs) {
  image::View left{5, 3, std::vector<uint32_t>(15, 0x102030), {}}, right = left, out;
  left.colour[0] = 0x000000, left.colour[1] = 0x0402ff;
  compose(Mode::kSideBySideHalf, left, right, out);
  ASSERT_EQ(out.width, 5);
  EXPECT_EQ(out.colour[0] & 0xffffff, 0x020180u);
  EXPECT_EQ(out.colour[1] & 0xffffff, 0x102030u);
  EXPECT_EQ(out.colour[4] & 0xffffff, 0u) << "the odd column shows nothing";
  left.colour[5] = 0x020406;
  compose(Mode::kTopBottomHalf, left, right, out);
  ASSERT_EQ(out.height, 3);
  EXPECT_EQ(out.colour[0] & 0xffffff, 0x010203u);
  EXPECT_EQ(out.colour[5] & 0xffffff, 0x102030u);
  EXPECT_EQ(out.colour[10] & 0xffffff, 0u);
}

TEST(StereoCompose, InterleavedPixelsStayInTheirPlaces) {
  for (const Mode mode : {Mode::kRows, Mode::kColumns, Mode::kChecker}) {
    const auto out = composed(mode);
    ASSERT_EQ(out.width, 6);
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 6; ++x) {
        const int odd = mode == Mode::kRows ? y : mode == Mode::kColumns ? x : x + y;
        EXPECT_EQ(eye_at(out, x, y), odd % 2 ? 2u : 1u) << name_of(mode) << " " << x << ", " << y;
        EXPECT_EQ(place_at(out, x, y), uint32_t(y << 8 | x));
      }
  }
}

uint32_t through_glasses(Mode mode, uint32_t left, uint32_t right) {
  uint32_t out = 0;
  anaglyph(mode, &left, &right, 1, &out);
  return out;
}

TEST(StereoAnaglyph, GreyIsLumaAndColoursAreChannels) {
  EXPECT_EQ(through_glasses(Mode::kAnaglyphGrey, 0xff0000, 0x00ff00), 0x4c9696u);  // 0.299 and 0.587 of 255
  EXPECT_EQ(through_glasses(Mode::kAnaglyphColour, 0x123456, 0xff789abc), 0xff129abcu);
  for (const Mode mode : {Mode::kAnaglyphGrey, Mode::kAnaglyphColour, Mode::kAnaglyphDubois}) {
    EXPECT_EQ(through_glasses(mode, 0, 0), 0u);
    EXPECT_EQ(through_glasses(mode, 0xffffff, 0xffffff), 0xffffffu) << name_of(mode);
  }
}

// Greys stay the same: the rows of both matrices together add up to 1.
TEST(StereoAnaglyph, GreysKeepTheirLight) {
  for (uint32_t g = 0; g < 256; ++g) {
    const uint32_t grey = g * 0x010101, out = through_glasses(Mode::kAnaglyphDubois, grey, grey);
    for (const int shift : {0, 8, 16}) EXPECT_NEAR(int(out >> shift & 255), int(g), 1) << g;
    EXPECT_EQ(through_glasses(Mode::kAnaglyphGrey, grey, grey), grey);
  }
}

// The red filter passes the left eye's picture, the cyan one next to none of it.
TEST(StereoAnaglyph, DuboisPartsTheEyes) {
  const uint32_t left_alone = through_glasses(Mode::kAnaglyphDubois, 0xffffff, 0),
                 right_alone = through_glasses(Mode::kAnaglyphDubois, 0, 0xffffff);
  EXPECT_EQ(left_alone & 0x00ffff, 0u);
  EXPECT_GT(left_alone >> 16 & 255, 240u);
  EXPECT_EQ(right_alone >> 16 & 255, 0u);
  EXPECT_EQ(right_alone & 0x00ffff, 0xffffu);
}

TEST(StereoPattern, CalibrationIsRedAndBlueWithAWhiteCross) {
  const auto [left, right] = eye_patterns(Pattern::kCalibration, 320, 200);
  EXPECT_EQ(left.colour.front() & 0xffffff, 0xff0000u);
  EXPECT_EQ(right.colour.front() & 0xffffff, 0x0000ffu);
  EXPECT_EQ(left.colour[100 * 320 + 160] & 0xffffff, 0xffffffu);
  EXPECT_EQ(right.colour[100 * 320 + 140] & 0xffffff, 0xffffffu);
  const auto [a, b] = eye_patterns(Pattern::kTest, 320, 200);
  EXPECT_NE(a.colour, b.colour);
  EXPECT_EQ(a.colour.size(), 320u * 200u);
}

}  // namespace
}  // namespace telesplat::stereo
