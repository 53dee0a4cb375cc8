// The finish gives the same pixels on every instruction set, for every width, as the plain loops of its definition; and
// those loops do their job.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/finish_plainly.h"
#include "tests/support/simd_targets.h"

namespace telesplat {
namespace {

using splat::FinishScratch;
using splat::Gaps;
using testing::OwnTile;

constexpr uint32_t kNear = 90000, kFar = 100000;  // depth codes

// Two slanted surfaces before one another, with holes of all sizes, in the whole buffer.
OwnTile random_tile(uint32_t seed, int width, int height) {
  std::mt19937 rng(seed);
  OwnTile out(width, height);
  const int m = out.tile.margin;
  for (int y = -m; y < height + m; ++y)
    for (int x = -m; x < width + m; ++x) {
      const bool near = std::sin(0.31 * x + seed) + std::cos(0.23 * y) > 0.1;
      const uint32_t kind = rng() % 16;
      if (kind == 0 || (std::sin(0.5 * x) * std::sin(0.4 * y + seed) > 0.9)) continue;
      const uint32_t code = (near && kind > 2 ? kNear : kFar) + static_cast<uint32_t>(m + x) * 11 + (rng() & 63);
      out.set(x, y, rng() & 0xffffff, code, rng() & 3);
    }
  return out;
}

void expect_same(const OwnTile& expected, const OwnTile& actual, int grow, const std::string& what) {
  for (int y = -grow; y < expected.tile.height + grow; ++y)
    for (int x = -grow; x < expected.tile.width + grow; ++x) {
      ASSERT_EQ(expected.colour(x, y), actual.colour(x, y)) << what << ": colour at " << x << ", " << y;
      ASSERT_EQ(expected.info(x, y), actual.info(x, y)) << what << ": info at " << x << ", " << y;
    }
}

TEST(Finish, EveryStageOnEveryTargetAndWidthEqualsThePlainLoops) {
  for (int width = 1; width <= 40; ++width) {
    const OwnTile tile = random_tile(static_cast<uint32_t>(width), width, 7 + width % 5);
    OwnTile filled = tile, all_filled = tile, smoothed = tile, antialiased = tile;
    testing::fill_plainly(filled, 2, Gaps::kPinHoles);
    testing::fill_plainly(all_filled, 2, Gaps::kAll);
    testing::smooth_plainly(smoothed, 1);
    testing::antialias_plainly(antialiased);
    for (const int64_t target : testing::simd_targets()) {
      const testing::OnTarget on(target);
      const std::string what = std::string(hwy::TargetName(target)) + ", width " + std::to_string(width);
      FinishScratch scratch;
      OwnTile a = tile, all = tile, b = tile, c = tile;
      EXPECT_GT(splat::fill_holes(a.tile, 2, Gaps::kPinHoles, scratch), 0);
      EXPECT_GT(splat::fill_holes(all.tile, 2, Gaps::kAll, scratch), 0);
      splat::smooth(b.tile, 1, scratch);
      splat::antialias(c.tile, scratch);
      expect_same(filled, a, 2, "fill on " + what);
      expect_same(all_filled, all, 2, "fill all on " + what);
      expect_same(smoothed, b, 1, "smooth on " + what);
      expect_same(antialiased, c, 0, "antialias on " + what);
    }
  }
}

TEST(Finish, CroppingToContentLosesNothingThatAStageChanges) {
  std::mt19937 rng(5);
  for (int round = 0; round < 60; ++round) {
    // A patch of surface with holes, maybe only in the margin, maybe outside.
    OwnTile tile(37, 29);
    const int reach = splat::finish_reach({});
    const int x0 = static_cast<int>(rng() % 50) - 10, y0 = static_cast<int>(rng() % 44) - 10;
    const int w = static_cast<int>(rng() % 20), h = static_cast<int>(rng() % 20);
    for (int y = std::max(y0, -reach); y < std::min(y0 + h, 29 + reach); ++y)
      for (int x = std::max(x0, -reach); x < std::min(x0 + w, 37 + reach); ++x)
        if (rng() % 5) tile.set(x, y, rng() & 0xffffff, (rng() % 9 ? kNear : kFar) + (rng() & 63), rng() & 3);
    OwnTile whole = tile, part = tile;
    FinishScratch scratch;
    const auto finish = [&](const splat::ResolvedTile& t) {
      splat::fill_holes(t, 2, Gaps::kPinHoles, scratch);
      splat::smooth(t, 1, scratch);
      splat::antialias(t, scratch);
    };
    finish(whole.tile);
    for (const int64_t target : testing::simd_targets()) {
      const testing::OnTarget on(target);
      OwnTile cropped = part;
      const splat::ResolvedTile content = splat::crop_to_content(cropped.tile, reach);
      ASSERT_GE(content.width, 0);
      ASSERT_LE(content.width, 37);
      if (content.width > 0 && content.height > 0) finish(content);
      expect_same(whole, cropped, 0, std::string(hwy::TargetName(target)) + ", round " + std::to_string(round));
    }
  }
}

// A disc of surface of radius 20 in the middle, nothing around it.
OwnTile disc_tile() {
  OwnTile out(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      if (std::hypot(x - 31.5, y - 31.5) < 20) out.set(x, y, 0x808080, kNear);
  return out;
}

TEST(Finish, FillClosesPinHolesAndNothingElse) {
  const OwnTile whole = disc_tile();
  OwnTile t = whole;
  // One pixel, two, a 2x2 block, a diagonal pair: pin-holes. A gap of 8 pixels is too large.
  for (const auto& [x, y] :
       {std::pair{30, 30}, {35, 28}, {36, 28}, {25, 36}, {26, 36}, {25, 37}, {26, 37}, {40, 40}, {41, 41}})
    t.tile.info(y)[x] = splat::kEmptyInfo;
  for (int y = 18; y < 26; ++y)
    for (int x = 26; x < 34; ++x) t.tile.info(y)[x] = splat::kEmptyInfo;
  FinishScratch scratch;
  splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch);
  int closed_in_gap = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool gap = x >= 26 && x < 34 && y >= 18 && y < 26;
      if (!gap) {
        EXPECT_EQ(t.empty(x, y), whole.empty(x, y)) << x << ", " << y;
      }
      if (gap) closed_in_gap += !t.empty(x, y);
      if (!gap && !t.empty(x, y)) {
        EXPECT_EQ(t.colour(x, y), 0x808080u) << x << ", " << y;
      }
    }
  EXPECT_EQ(closed_in_gap, 0);
}

TEST(Finish, FillClosesHolesThroughWhichAFartherSurfaceShows) {
  OwnTile t(32, 32);
  for (int y = -5; y < 37; ++y)
    for (int x = -5; x < 37; ++x) t.set(x, y, 0x2040f0, kNear);
  t.set(10, 10, 0xff0000, kFar), t.set(20, 12, 0xff0000, kFar), t.set(21, 12, 0xff0000, kFar);
  FinishScratch scratch;
  EXPECT_EQ(splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch), 3);
  EXPECT_EQ(t.colour(10, 10), 0x2040f0u);
  EXPECT_EQ(t.info(21, 12) >> 8, kNear);
}

TEST(Finish, FillNeverReachesAcrossDepthEdges) {
  // A slit of one pixel between a near and a far surface: its sides do not match.
  OwnTile t(32, 32);
  for (int y = -5; y < 37; ++y)
    for (int x = -5; x < 37; ++x)
      if (x != 16) t.set(x, y, 0x404040, x < 16 ? kNear : kFar);
  FinishScratch scratch;
  EXPECT_EQ(splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch), 0);
}

// Ribs two pixels wide, a pixel apart, each at its own depth.
TEST(Finish, FillLeavesGapsBetweenRibsOpen) {
  OwnTile t(32, 32);
  for (int y = -5; y < 37; ++y)
    for (int x = -5; x < 37; ++x)
      if ((x + 6) % 3 != 0) t.set(x, y, 0x404040, kNear + ((x + 6) / 3 % 2 ? 300 : 0));
  const OwnTile before = t;
  FinishScratch scratch;
  EXPECT_EQ(splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch), 0);
  expect_same(before, t, 0, "ribs");
  // A hole in a rib is closed all the same, and with sub-pixels every gap is closed.
  t.tile.info(16)[13] = splat::kEmptyInfo;
  OwnTile all = t;
  EXPECT_EQ(splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch), 1);
  EXPECT_GT(splat::fill_holes(all.tile, 2, Gaps::kAll, scratch), 300);
}

// Empty pixels beside a silhouette: the nearer surface hid them until now.
TEST(Finish, FillShowsTheFartherSurfaceBesideASilhouette) {
  OwnTile t(32, 32);
  for (int y = -5; y < 37; ++y)
    for (int x = -5; x < 37; ++x) t.set(x, y, x < 16 ? 0x404040 : 0xff0000, x < 16 ? kNear : kFar);
  t.tile.info(10)[16] = t.tile.info(20)[16] = splat::kEmptyInfo;
  FinishScratch scratch;
  EXPECT_EQ(splat::fill_holes(t.tile, 2, Gaps::kPinHoles, scratch), 2);
  for (const int y : {10, 20}) {
    EXPECT_EQ(t.colour(16, y), 0xff0000u);
    EXPECT_EQ(t.info(16, y) >> 8, kFar);
  }
}

TEST(Finish, SmoothingSamplesTwoPixelsApartIsBilinearInterpolation) {
  OwnTile t(32, 32);
  const auto sample = [](int i, int j) { return 20 + 5 * i + 3 * j + (i * j) % 7 * 4; };
  for (int y = -6; y < 38; ++y)
    for (int x = -6; x < 38; ++x)
      t.set(x, y, 0x010101u * static_cast<uint32_t>(sample((x + 6) / 2, (y + 6) / 2)), kNear, 2);
  FinishScratch scratch;
  splat::smooth(t.tile, 1, scratch);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      // The pixel's centre lies a quarter of a spacing off its sample's.
      const double u = (x + 6 + 0.5) / 2 - 0.5, v = (y + 6 + 0.5) / 2 - 0.5;
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const double a = u - i, b = v - j;
      const double expected = (1 - a) * (1 - b) * sample(i, j) + a * (1 - b) * sample(i + 1, j) +
                              (1 - a) * b * sample(i, j + 1) + a * b * sample(i + 1, j + 1);
      EXPECT_NEAR(t.colour(x, y) & 255, expected, 0.51) << x << ", " << y;
    }
}

TEST(Finish, SamplesAPixelApartStayAsTheyAre) {
  OwnTile t = random_tile(3, 30, 30);
  for (int y = -8; y < 38; ++y)
    for (int x = -8; x < 38; ++x)
      if (!t.empty(x, y)) t.tile.info(y)[x] &= ~(3u << 3);
  const OwnTile before = t;
  FinishScratch scratch;
  splat::smooth(t.tile, 1, scratch);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 30; ++x)
      if (!t.empty(x, y)) {
        EXPECT_EQ(t.colour(x, y), before.colour(x, y)) << x << ", " << y;
      }
}

TEST(Finish, CoverageWeightsAreMeans) {
  for (uint32_t near_there = 0; near_there < 2; ++near_there)
    for (uint32_t weight = 1; weight < 16; ++weight) {
      const size_t i = 17 * near_there + weight;
      const uint32_t near = splat::kCoverageWeights.near[i] * weight,
                     far = splat::kCoverageWeights.far[i] * (16 - weight);
      EXPECT_NEAR(near, 1024.0 * splat::kCoverage[near_there][weight], 8);
      // A constant colour stays as it is, rounded.
      EXPECT_LT(std::abs(int(near + far) - 65536) * 255, 32768) << i;
    }
}

// Splats reach beyond silhouettes: the antialiased edge lies at the outermost samples, not half a pixel outside.
TEST(Finish, AntialiasDrawsSilhouettesThinner) {
  OwnTile t(32, 32);
  for (int y = -5; y < 37; ++y)
    for (int x = -5; x < 16; ++x) t.set(x, y, 0xc0c0c0, kNear);
  for (int y = -5; y < 37; ++y)
    for (int x = 16; x < 37; ++x) t.set(x, y, 0x000000, kFar);
  FinishScratch scratch;
  splat::antialias(t.tile, scratch);
  double covered = 0;
  for (int x = 10; x < 22; ++x) covered += (t.colour(x, 16) & 255) / 192.0;
  EXPECT_NEAR(covered, 5.64, 0.05);  // 6 pixels before
  EXPECT_EQ(t.colour(14, 16), 0xc0c0c0u);
  EXPECT_LT(t.colour(16, 16) & 255, 6u);
}

TEST(Finish, AntialiasBlendsSilhouettesAndLeavesSurfacesAlone) {
  OwnTile t = disc_tile();
  FinishScratch scratch;
  splat::antialias(t.tile, scratch);
  int blended = 0;
  for (int y = 1; y < 63; ++y)
    for (int x = 1; x < 63; ++x) {
      const double r = std::hypot(x - 31.5, y - 31.5);
      const uint32_t c = t.colour(x, y);
      if (r < 18) {
        EXPECT_EQ(c, 0x808080u);
      }
      if (r > 22) {
        EXPECT_EQ(c, 0x141820u);
      }
      blended += c != 0x808080u && c != 0x141820u;
    }
  EXPECT_GT(blended, 150);  // about twice the circumference
  EXPECT_LT(blended, 350);
}

}  // namespace
}  // namespace telesplat
