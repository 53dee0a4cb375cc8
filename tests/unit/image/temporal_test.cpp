// Measures in time: changes that the data did not make, and the fate of holes.
#include "common/image/measures/temporal.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/image/measures/quality.h"

namespace telesplat::image {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

View flat(int width, int height, uint32_t colour, float depth_m) {
  const size_t n = size_t(width) * height;
  return {width, height, std::vector<uint32_t>(n, colour), std::vector<float>(n, depth_m)};
}

View noise(int width, int height, uint32_t seed) {
  View v = flat(width, height, 0, 1);
  std::mt19937 random(seed);
  for (uint32_t& c : v.colour) c = random() & 0xffffff;
  return v;
}

Unsteadiness between(const View& reference0, const View& displayed0, const View& reference1, const View& displayed1) {
  const geometry::Camera camera;
  const Reference r0 = reference_of(reference0), r1 = reference_of(reference1);
  return unsteadiness({camera, r0, displayed0}, {camera, r1, displayed1});
}

TEST(Unsteadiness, AnErrorThatStaysDoesNotFlicker) {
  const View first = noise(40, 24, 1), second = noise(40, 24, 2);
  const auto same = between(first, first, second, second);
  EXPECT_EQ(same.flicker, 0);
  EXPECT_EQ(same.popping, 0);
  EXPECT_EQ(same.pixels, 960u);
  View off0 = flat(40, 24, 0x303030, 1), off1 = flat(40, 24, 0x505050, 1);  // 32 too bright, twice
  EXPECT_EQ(between(flat(40, 24, 0x101010, 1), off0, flat(40, 24, 0x303030, 1), off1).flicker, 0);
}

TEST(Unsteadiness, AChangeThatTheDataDidNotMakeCounts) {
  const View still = flat(40, 24, 0x404040, 1);
  View shown = still;
  for (int y = 8; y < 16; ++y)
    for (int x = 16; x < 24; ++x) shown.colour[size_t(y) * 40 + x] = 0x5e4040;  // 30 in red: 10 a channel
  const auto popped = between(still, still, still, shown);
  EXPECT_NEAR(popped.flicker, 64 * 10.0 / 960, 1e-12);
  EXPECT_NEAR(popped.popping, 10, 1e-12) << "one block of 15";
  const auto missed = between(still, still, shown, still);
  EXPECT_NEAR(missed.flicker, popped.flicker, 1e-12) << "the data changed, the display did not";
  EXPECT_NEAR(between(still, still, shown, shown).flicker, 0, 1e-12);
}

TEST(Unsteadiness, OppositeChangesOfAChannelAddUp) {
  const View a = flat(8, 8, 0x404040, 1), up = flat(8, 8, 0x434040, 1), down = flat(8, 8, 0x3d4040, 1);
  EXPECT_NEAR(between(a, a, up, down).flicker, 2, 1e-12);
}

TEST(Unsteadiness, PoppingIsThe999thOfAThousandBlocks) {
  const View still = flat(8 * 100, 8 * 20, 0x404040, 1);
  View shown = still;
  // In blue, three of 2000 blocks change by 128 to 130 steps, the others by 1.
  for (int y = 0; y < still.height; ++y)
    for (int x = 0; x < still.width; ++x) {
      const int block = (y / 8 * 100 + x / 8) * 7 % 2000;
      shown.colour[size_t(y) * still.width + x] = 0x404040u - 0x40u + uint32_t(block < 3 ? 0xc0 + block : 0x41);
    }
  // Means over the channels, sorted: 1997 of 1/3, then 128/3, 129/3, 130/3; the rank is 0.999 * 2000 = 1998.
  EXPECT_NEAR(between(still, still, still, shown).popping, 128 / 3.0, 1e-9);
}

TEST(Unsteadiness, BlocksAreCutAtTheBorder) {
  const View still = flat(11, 9, 0x404040, 1);
  View shown = still;
  for (int y = 8; y < 9; ++y)
    for (int x = 8; x < 11; ++x) shown.colour[size_t(y) * 11 + x] = 0x434343;
  EXPECT_NEAR(between(still, still, still, shown).popping, 3, 1e-12);
}

TEST(Unsteadiness, WhatShowsNoDataDoesNotCount) {
  View a = flat(16, 8, 0x404040, kNothing), b = flat(16, 8, 0x808080, kNothing);
  EXPECT_EQ(between(a, a, a, b).pixels, 0u);
  b.depth_m[3] = 1;  // the display shows an object where the data have none
  const auto seen = between(a, a, a, b);
  EXPECT_EQ(seen.pixels, 1u);
  EXPECT_NEAR(seen.flicker, 64, 1e-12);
}

// A wall 2 m away, seen from two places `moved_px` pixels apart.
class HoleFatesOfAWall : public ::testing::Test {
 protected:
  HoleFatesOfAWall() {
    before_.left = -1, before_.right = 1, before_.bottom = -0.5, before_.top = 0.5;
    before_.width = 80, before_.height = 40;
    after_ = before_;
    after_.pose.position_room.x = 3 * 2.0 / before_.focal_x();  // 3 pixels to the left in the picture
  }
  HoleFates follow() {
    const Reference r0 = reference_of(wall_), r1 = reference_of(wall_after_);
    return follow_holes({before_, r0, shown0_}, {after_, r1, shown1_});
  }
  static size_t at(int x, int y) { return size_t(y) * 80 + x; }

  geometry::Camera before_, after_;
  View wall_ = flat(80, 40, 0x808080, 2), wall_after_ = wall_, shown0_ = wall_, shown1_ = wall_;
};

TEST_F(HoleFatesOfAWall, HolesAreFollowedToWhereTheirPlaceMoved) {
  shown0_.depth_m[at(20, 10)] = kNothing;
  shown0_.depth_m[at(60, 30)] = 5;
  EXPECT_EQ(follow().followed, 2u);
  EXPECT_EQ(follow().closed, 2u);
  shown1_.depth_m[at(17, 10)] = kNothing;
  EXPECT_EQ(follow().closed, 1u);
  shown1_.depth_m[at(56, 31)] = 5;  // a pixel beside it still is one
  EXPECT_EQ(follow().closed, 0u);
}

TEST_F(HoleFatesOfAWall, AHoleWhereTheOldOneWasIsAnother) {
  shown0_.depth_m[at(20, 10)] = shown1_.depth_m[at(20, 10)] = kNothing;
  EXPECT_EQ(follow().closed, 1u);
}

TEST_F(HoleFatesOfAWall, PlacesThatGoOutOfSightAreNotFollowed) {
  shown0_.depth_m[at(2, 10)] = kNothing;  // leaves the picture
  EXPECT_EQ(follow().followed, 0u);
  shown0_.depth_m[at(20, 10)] = kNothing;
  wall_after_.depth_m[at(17, 10)] = 1;  // something moved in front of it
  EXPECT_EQ(follow().followed, 0u);
  wall_after_.depth_m[at(17, 10)] = kNothing;  // it went away
  EXPECT_EQ(follow().followed, 0u);
  after_.pose.position_room.z = -4;  // behind the wall
  EXPECT_EQ(follow().followed, 0u);
}

}  // namespace
}  // namespace telesplat::image
