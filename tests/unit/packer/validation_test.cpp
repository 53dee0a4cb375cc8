// Validation: rays confirm or disprove the points that viewers show.
#include "services/packer/points/plan/validation.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/image/normal.h"
#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kWidth = 128, kHeight = 96;

// A grey wall across the view, 0.7 m away, and a model that shows it.
struct Wall {
  points::ModelConfig model = test::scene_config(5);
  geometry::Camera camera = test::scene_camera({0.0, 0.0, 0.7}, kWidth, kHeight);
  std::vector<float> depth_m = std::vector<float>(size_t{kWidth} * kHeight, 0.7f);
  std::vector<uint32_t> colour = std::vector<uint32_t>(size_t{kWidth} * kHeight, 0x808080);
  std::vector<uint16_t> normal =
      std::vector<uint16_t>(size_t{kWidth} * kHeight, image::encode_normal16(glm::vec3(0, 0, 1)));
  image::PixelMask firm{kWidth, kHeight}, cast{kWidth, kHeight};
  geometry::Rect all{0, 0, kWidth, kHeight};
  image::DepthImage came{kWidth, kHeight};

  Wall() {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) firm.set(x, y), cast.set(x, y), put(x, y, 0.7, 0x808080);
  }
  void put(int x, int y, double depth, uint32_t c, const glm::vec3& n = {0, 0, 1}) {
    const size_t i = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
    came.depth[i] = depth > 0 ? image::encode_depth(depth, camera.near_m) : 0;
    came.colour[i] = depth > 0 ? c : 0;
    came.normal[i] = depth > 0 ? image::encode_normal16(n) : uint16_t{0};
  }
  ShownView shown() const { return {camera, depth_m, colour, normal, firm}; }
  Validation::Verdict judge(int x, int y) const {
    return Validation(model).judge(shown(), x, y, came, static_cast<size_t>(y) * kWidth + static_cast<size_t>(x));
  }
  image::PixelMask check(Validation& v, double now_s) const {
    image::PixelMask out;
    v.check(shown(), {all, cast, came}, now_s, out);
    return out;
  }
};

using Verdict = Validation::Verdict;

TEST(Validation, RaysAreJudgedByDepthColourAndNormal) {
  Wall wall;
  EXPECT_EQ(wall.judge(60, 40), Verdict::kAgrees);
  wall.put(60, 40, 0.702, 0x888078);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kAgrees);
  wall.put(60, 40, 0.65, 0x808080);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kNearer);
  wall.put(60, 40, 0.75, 0x808080);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kFarther);
  wall.put(60, 40, 0, 0);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kMissed);
  wall.put(60, 40, 0.7, 0xff8080);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kColour);
  wall.put(60, 40, 0.7, 0x808080, {1, 0, 0});
  EXPECT_EQ(wall.judge(60, 40), Verdict::kNormal);
}

TEST(Validation, WhatLiesBetweenThePixelsAroundAgrees) {
  Wall wall;
  // A black and white checkerboard, and a ramp: a sample beside a pixel's centre sees a colour between two pixels'.
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const size_t i = static_cast<size_t>(y) * kWidth + static_cast<size_t>(x);
      wall.colour[i] = (x + y) % 2 ? 0xffffff : 0;
      wall.depth_m[i] = 0.5f + 0.02f * static_cast<float>(x);
    }
  wall.put(60, 40, wall.depth_m[40 * kWidth + 60] + 0.03, 0x808080);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kAgrees);
  wall.put(60, 40, wall.depth_m[40 * kWidth + 60] + 0.08, 0x808080);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kFarther);
}

TEST(Validation, BesideASilhouetteAMissSaysNothing) {
  Wall wall;
  for (int y = 0; y < kHeight; ++y) wall.depth_m[static_cast<size_t>(y) * kWidth + 62] = kInfinity;
  wall.put(60, 40, 0, 0);
  wall.put(30, 40, 0, 0);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kNone);
  EXPECT_EQ(wall.judge(30, 40), Verdict::kMissed);
}

TEST(Validation, AHitWhereNothingIsShownContradicts) {
  Wall wall;
  std::fill(wall.depth_m.begin(), wall.depth_m.end(), kInfinity);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kNearer);
  wall.put(60, 40, 0, 0);
  EXPECT_EQ(wall.judge(60, 40), Verdict::kAgrees);
}

TEST(Validation, OnlyFirmPixelsThatWereCastAreJudged) {
  Wall wall;
  Validation v(wall.model);
  wall.put(60, 40, 0.6, 0), wall.put(61, 40, 0.6, 0), wall.put(62, 40, 0.6, 0);
  wall.firm.clear(61, 40), wall.cast.clear(62, 40);
  const image::PixelMask contradicted = wall.check(v, 0);
  EXPECT_EQ(contradicted.count(), 1u);
  EXPECT_TRUE(contradicted.at(60, 40));
  EXPECT_EQ(v.statistics().rays, uint64_t{kWidth} * kHeight - 2);
  EXPECT_EQ(v.statistics().nearer, 1u);
}

TEST(Validation, WhereRaysHaveContradictedBeforeNothingBecomesStaleAgain) {
  Wall wall;
  Validation v(wall.model);
  for (int x = 60; x < 70; ++x) wall.put(x, 40, 0, 0);
  image::PixelMask doubted = wall.check(v, 10);
  EXPECT_EQ(doubted.count(), 10u);
  const size_t marks = v.marks();
  image::PixelMask contradicted;
  v.check(wall.shown(), {wall.all, wall.cast, wall.came, &doubted}, 10.1, contradicted);
  EXPECT_EQ(v.marks(), marks);
  EXPECT_EQ(contradicted.count(), 10u);
  EXPECT_EQ(v.statistics().missed, 20u) << "it is evidence all the same";
  wall.put(100, 80, 0, 0);
  v.check(wall.shown(), {wall.all, wall.cast, wall.came, &doubted}, 10.2, contradicted);
  EXPECT_EQ(v.marks(), marks + 1) << "news";
}

TEST(Validation, AContradictionMakesItsSurroundingsStaleUntilTheyAreSampled) {
  Wall wall;
  Validation v(wall.model);
  wall.put(60, 40, 0.6, 0);
  wall.check(v, 10);
  ASSERT_EQ(v.marks(), 1u);
  image::PixelMask stale(kWidth, kHeight);
  v.mark_stale(wall.camera, 10.1, stale);
  EXPECT_TRUE(stale.at(60, 40));
  EXPECT_EQ(stale.count(), 16u * 16);
  v.resampled(9);  // the time of another plan
  EXPECT_EQ(v.marks(), 1u);
  v.resampled(10.1);
  EXPECT_EQ(v.marks(), 0u);
}

TEST(Validation, MarksFollowTheirPlaceAndRunOut) {
  Wall wall;
  Validation v(wall.model);
  wall.put(60, 40, 0.6, 0);
  wall.check(v, 10);
  geometry::Camera beside = wall.camera;
  beside.pose.position_room.x += 0.05;
  image::PixelMask stale(kWidth, kHeight);
  v.mark_stale(beside, 10.5, stale);
  EXPECT_GT(stale.count(), 0u);
  EXPECT_TRUE(stale.at(60 - static_cast<int>(std::lround(0.05 / 0.6 * beside.focal_x())), 40));
  beside.pose.position_room.z = -3;  // the marked place is behind the eye
  stale.reset(kWidth, kHeight);
  v.mark_stale(beside, 10.5, stale);
  EXPECT_EQ(stale.count(), 0u);
  v.mark_stale(wall.camera, 12, stale);
  EXPECT_EQ(stale.count(), 0u);
  EXPECT_EQ(v.marks(), 0u);
}

TEST(Validation, ManyRaysThroughAClusterDisproveItAndFewDoNot) {
  Wall wall;
  Validation v(wall.model);
  for (int i = 0; i < 5; ++i) wall.put(60 + i, 40, 0, 0);
  wall.check(v, 0);
  EXPECT_TRUE(v.disproved().empty());
  for (int y = 40; y < 60; ++y)
    for (int x = 50; x < 70; ++x) wall.put(x, y, 0, 0);
  wall.check(v, 0.1);
  const auto keys = v.disproved();
  ASSERT_FALSE(keys.empty());
  // The disproved clusters lie where the rays went through the wall.
  for (const points::ClusterKey key : keys) {
    const geometry::Box leaf = points::leaf_box(wall.model, key);
    EXPECT_LE(leaf.lo.z, 0.001f);
    EXPECT_GE(leaf.hi.z, -0.001f);
  }
  EXPECT_TRUE(v.disproved().empty());
}

TEST(Validation, OtherColoursAndNormalsDisproveToo) {
  for (const bool colour : {false, true}) {
    Wall wall;
    Validation v(wall.model);
    for (int y = 40; y < 60; ++y)
      for (int x = 50; x < 70; ++x)
        wall.put(x, y, 0.7, colour ? 0x2000ff : 0x808080, colour ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0));
    wall.check(v, 0);
    EXPECT_FALSE(v.disproved().empty());
  }
}

TEST(Validation, SomethingNearerDisprovesNothingBehindIt) {
  Wall wall;
  Validation v(wall.model);
  for (int y = 40; y < 60; ++y)
    for (int x = 50; x < 70; ++x) wall.put(x, y, 0.5, 0xff);
  EXPECT_EQ(wall.check(v, 0).count(), 400u);
  EXPECT_TRUE(v.disproved().empty());
}

// A cluster that keeps looking wrong because splats cannot show it is forgotten less and less often.
TEST(Validation, EachTimeMoreProofIsAskedFor) {
  Wall wall;
  Validation v(wall.model);
  for (int y = 40; y < 60; ++y)
    for (int x = 50; x < 70; x += 2) wall.put(x, y, 0, 0);
  int times = 0;
  for (int i = 0; i < 40; ++i) {
    wall.check(v, 0.1 * i);
    const auto keys = v.disproved();
    times += !keys.empty();
    v.forgotten(keys);
  }
  EXPECT_GE(times, 1);
  EXPECT_LE(times, 20);
}

TEST(Validation, AnEpochForgetsMarksAndEvidence) {
  Wall wall;
  Validation v(wall.model);
  wall.put(60, 40, 0.6, 0);
  for (int y = 40; y < 60; ++y)
    for (int x = 50; x < 70; ++x) wall.put(x, y, 0, 0);
  wall.check(v, 0);
  v.clear();
  EXPECT_EQ(v.marks(), 0u);
  EXPECT_TRUE(v.disproved().empty());
}

}  // namespace
}  // namespace telesplat::packer
