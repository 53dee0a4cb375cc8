// Seen space: cells that a view carves, cells that it leaves, cells that become unseen again.
#include "services/packer/points/plan/known_empty.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

const points::ModelConfig kModel = test::scene_config();

geometry::Camera camera(double turn, int width = 320, int height = 200) {
  return test::scene_camera({0.8 * std::cos(turn), 0.3, 0.8 * std::sin(turn)}, width, height);
}

std::vector<float> depths(const geometry::Camera& c, const image::DepthImage& image) {
  std::vector<float> out(image.pixels(), kInfinity);
  for (size_t i = 0; i < out.size(); ++i)
    if (image.depth[i] != 0) out[i] = static_cast<float>(image::decode_depth(image.depth[i], c.near_m));
  return out;
}

// A view of the ball above its floor, with all of its points.
struct View {
  explicit View(const geometry::Camera& c)
      : camera(c),
        image(test::sample_scene(c, {0, 0, c.width, c.height})),
        depth_m(depths(c, image)),
        patch(points::prepare_patch(kModel, {1}, c, {0, 0, c.width, c.height}, image)) {}
  void see(KnownEmpty& space) const {
    space.add(patch);
    space.carve(camera, depth_m, 2);
  }
  size_t unseen_before_surfaces(const KnownEmpty& space, image::PixelMask* out = nullptr) const {
    image::PixelMask mask;
    space.project(camera, depth_m, 2, mask);
    if (out) *out = mask;
    return mask.count();
  }
  geometry::Camera camera;
  image::DepthImage image;
  std::vector<float> depth_m;
  points::PreparedPatch patch;
};

glm::ivec3 cell_at(const KnownEmpty& space, const glm::dvec3& room) {
  return {glm::floor((room - points::octree_grid(kModel).lo) / space.cell_m())};
}

TEST(KnownEmpty, AtFirstAllOfTheBoxIsUnseenAndNothingElse) {
  const KnownEmpty space(kModel);
  EXPECT_TRUE(space.unseen(cell_at(space, {0, 0, 0})));
  EXPECT_TRUE(space.unseen(cell_at(space, {-0.399, -0.299, 0.399})));
  EXPECT_FALSE(space.unseen(cell_at(space, {0, 0.35, 0})));  // in the cube, above the box
  const View view(test::scene_camera({2, 0, 0}, 320, 200));
  const size_t pixels = view.unseen_before_surfaces(space);
  EXPECT_GT(pixels, 320u * 200 / 20);  // where the box is
  EXPECT_LT(pixels, 320u * 200 / 2);   // but not beside it
}

TEST(KnownEmpty, AViewSeesTheSpaceBeforeItsSurfacesAndAllOfItWhereItMissed) {
  KnownEmpty space(kModel);
  const View view(camera(0));
  view.see(space);
  EXPECT_FALSE(space.unseen(cell_at(space, {0.35, 0.1, 0})));  // between eye and ball
  EXPECT_TRUE(space.unseen(cell_at(space, {0, 0, 0})));        // inside the ball
  EXPECT_TRUE(space.unseen_at({0, 0, 0}));
  EXPECT_FALSE(space.unseen_at({0.35, 0.1, 0}));
  for (const double far : {5.0, -5.0, 1e300, -1e300}) EXPECT_FALSE(space.unseen_at({0, far, 0})) << "outside the cube";
  EXPECT_TRUE(space.unseen(cell_at(space, {-0.3, -0.15, 0})));     // in its shadow
  EXPECT_FALSE(space.unseen(cell_at(space, {-0.3, 0.15, 0.35})));  // beside it, against the sky
  // Hardly any pixel has unseen space before the surface just seen, except along steps of depth.
  EXPECT_LT(view.unseen_before_surfaces(space), 320u * 200 / 100);
}

TEST(KnownEmpty, WhatAStepAsideUncoversIsUnseenAndLittleElse) {
  KnownEmpty space(kModel);
  View(camera(0)).see(space);
  const View beside(camera(0.01));
  image::PixelMask mask;
  const size_t pixels = beside.unseen_before_surfaces(space, &mask);
  EXPECT_GT(pixels, 20u);
  EXPECT_LT(pixels, 320u * 200 / 50);
  beside.see(space);
  EXPECT_LT(beside.unseen_before_surfaces(space), pixels);
}

// Cells 5 cm before the eye are twenty pixels long.
TEST(KnownEmpty, AHeadWithinTheDataHasNotSeenWhatLiesBesideItsImage) {
  const auto turned = [](double degrees) {
    const double a = degrees * M_PI / 180;
    return geometry::make_camera(geometry::look_at({0, 0, 0}, {std::cos(a), 0, std::sin(a)}), 60, 320, 200);
  };
  KnownEmpty space(kModel);
  const std::vector<float> clear_m(size_t{320} * 200, 0.3f), shown_m(size_t{320} * 200, 0.06f);
  space.carve(turned(0), clear_m, 2);
  image::PixelMask mask;
  space.project(turned(0), shown_m, 2, mask);
  EXPECT_LT(mask.count(), 320u * 200 / 5) << "but for a rim";
  space.project(turned(60), shown_m, 2, mask);
  EXPECT_GT(mask.count(), 320u * 200 * 86 / 100) << "begins where the other view ends, but for a block";
}

// A view of a surface does not see another one close behind it: samples 0.4 mm apart, blocks of 6 mm.
TEST(KnownEmpty, PointsSeenFromNearHideNothingBehindThem) {
  KnownEmpty space(kModel);
  const View view(test::scene_camera({0.35, 0, 0}, 320, 200));
  space.add(view.patch);
  const double block_m = 2 * space.cell_m();
  size_t seen = 0, places = 0;
  for (double angle = -0.1; angle < 0.1; angle += 0.002, ++places)
    seen += !space.unseen_at(glm::dvec3(std::cos(angle), 0, std::sin(angle)) * (0.25 - 1.1 * block_m));
  EXPECT_EQ(seen, 0u) << "of " << places;
}

TEST(KnownEmpty, AWalkAroundTheSceneLeavesNearlyNothingToBeSeen) {
  KnownEmpty space(kModel);
  size_t pixels = 0;
  for (int i = 0; i < 126; ++i) {
    const View view(camera(0.05 * i, 160, 100));
    if (i >= 63) pixels += view.unseen_before_surfaces(space);
    view.see(space);
  }
  // The second half looks from the other side at surfaces that the first half has seen.
  EXPECT_LT(static_cast<double>(pixels) / (63 * 160 * 100), 0.01);
}

// Samples of a wall do not prove that the space before it is empty where no ray has been.
TEST(KnownEmpty, AnUnseenThingBeforeAKnownSurfaceMayBeThere) {
  KnownEmpty space(kModel);
  const geometry::Camera c = camera(0);
  const View view(c);
  // No rays were cast in the left half.
  std::vector<float> half = view.depth_m;
  for (size_t i = 0; i < half.size(); ++i)
    if (i % 320 < 160) half[i] = 0;
  space.add(view.patch);
  space.carve(c, half, 1);
  image::PixelMask mask;
  view.unseen_before_surfaces(space, &mask);
  EXPECT_TRUE(mask.at(80, 120));
  EXPECT_FALSE(mask.at(240, 120));
}

TEST(KnownEmpty, WhatWasKnownBeforeCountsAsClearButIsNotLookedAtAgain) {
  const View view(camera(0));
  std::vector<float> known = view.depth_m, half = view.depth_m;
  for (size_t i = 0; i < known.size(); ++i) {
    known[i] = -known[i];
    if (i % 2 == 0) half[i] = -half[i];
  }
  KnownEmpty nothing_new(kModel), half_new(kModel), all_new(kModel);
  const uint64_t cells = nothing_new.unseen_cells();
  nothing_new.carve(view.camera, known, 1);
  EXPECT_EQ(nothing_new.unseen_cells(), cells);
  half_new.carve(view.camera, half, 1);
  all_new.carve(view.camera, view.depth_m, 1);
  EXPECT_LT(all_new.unseen_cells(), cells);
  EXPECT_LT(static_cast<double>(half_new.unseen_cells()), 1.02 * static_cast<double>(all_new.unseen_cells()));
}

TEST(KnownEmpty, PixelsThatAreNotAskedForStayClear) {
  const KnownEmpty space(kModel);
  const View view(camera(0));
  std::vector<float> asked = view.depth_m;
  for (size_t i = 0; i < asked.size(); ++i)
    if (i % 2 == 0) asked[i] = i % 4 == 0 ? -1.0f : std::numeric_limits<float>::quiet_NaN();
  image::PixelMask all, some;
  space.project(view.camera, view.depth_m, 2, all);
  space.project(view.camera, asked, 2, some);
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 320; ++x) EXPECT_EQ(some.at(x, y), x % 2 != 0 && all.at(x, y));
}

TEST(KnownEmpty, AForgottenClusterIsUnseenAgain) {
  KnownEmpty space(kModel);
  const View view(camera(0));
  view.see(space);
  const points::ClusterKey key = view.patch.mosaics[view.patch.mosaics.size() / 2].first;
  space.forget(std::array{key});
  const geometry::Box leaf = points::leaf_box(kModel, key);
  EXPECT_TRUE(space.unseen(cell_at(space, glm::dvec3(leaf.centre()))));
  std::vector<float> nothing(view.depth_m.size(), kInfinity);
  image::PixelMask before, after;
  space.project(view.camera, nothing, 1, after);
  const auto t = view.camera.room_to_pixel();
  const glm::dvec4 p(glm::dvec3(leaf.centre()), 1);
  const double w = glm::dot(t.w, p);
  EXPECT_TRUE(after.at(static_cast<int>(glm::dot(t.x, p) / w), static_cast<int>(glm::dot(t.y, p) / w)));
}

TEST(KnownEmpty, AHitInKnownEmptySpaceMakesItsSurroundingsUnseen) {
  KnownEmpty space(kModel);
  View(camera(0)).see(space);
  const glm::vec3 hit(0.35f, 0.1f, 0);
  ASSERT_FALSE(space.unseen(cell_at(space, hit)));
  space.refill(std::array{hit, glm::vec3(NAN, 0, 0), glm::vec3(9, 9, 9)});
  EXPECT_TRUE(space.unseen(cell_at(space, hit)));
  EXPECT_TRUE(space.unseen(cell_at(space, glm::dvec3(hit) + 4 * space.cell_m())));
  EXPECT_FALSE(space.unseen(cell_at(space, glm::dvec3(hit) + 12 * space.cell_m())));
  View(camera(0)).see(space);
  EXPECT_FALSE(space.unseen(cell_at(space, hit)));
}

TEST(KnownEmpty, AnEpochBeginsWithEverythingUnseen) {
  KnownEmpty space(kModel);
  const uint64_t cells = space.unseen_cells();
  View(camera(1)).see(space);
  EXPECT_LT(space.unseen_cells(), cells);
  space.clear();
  EXPECT_EQ(space.unseen_cells(), cells);
}

TEST(KnownEmpty, ASparseModelsSurfacesHaveNoHoles) {
  // Samples lie several blocks apart; the surface between them counts as seen all the same.
  KnownEmpty space(kModel);
  const View coarse(camera(0, 64, 40));
  coarse.see(space);
  EXPECT_LT(coarse.unseen_before_surfaces(space), 64u * 40 / 15);
  const View fine(camera(0));
  EXPECT_LT(fine.unseen_before_surfaces(space), 320u * 200 / 50);
}

TEST(KnownEmpty, OctreesOfAnyDepthAreTaken) {
  const uint64_t cells = KnownEmpty(kModel).unseen_cells();
  for (const int depth : {0, 3, 8, 9, 10}) {
    points::ModelConfig model = kModel;
    model.depth = depth;
    KnownEmpty space(model);
    EXPECT_EQ(space.unseen_cells(), cells) << depth;
    const geometry::Camera c = camera(0, 160, 100);
    const image::DepthImage image = test::sample_scene(c, {0, 0, 160, 100});
    const points::PreparedPatch patch = points::prepare_patch(model, {1}, c, {0, 0, 160, 100}, image);
    space.add(patch);
    space.carve(c, depths(c, image), 1);
    image::PixelMask mask;
    space.project(c, depths(c, image), 1, mask);
    const size_t seen = mask.count();
    EXPECT_LT(seen, 160u * 100 / 30) << depth;
    std::vector<points::ClusterKey> keys;
    for (const auto& [key, mosaic] : patch.mosaics) keys.push_back(key);
    space.forget(keys);
    space.project(c, depths(c, image), 1, mask);
    EXPECT_GT(mask.count(), 2 * seen) << depth;
  }
}

TEST(KnownEmpty, CamerasAndDepthsOfAnyKindDoNoHarm) {
  KnownEmpty space(kModel);
  const uint64_t cells = space.unseen_cells();
  geometry::Camera far = camera(0, 64, 40);
  far.pose.position_room = {1e300, 0, 0};
  image::PixelMask mask;
  space.carve(far, std::vector<float>(64 * 40, kInfinity), 1);
  space.project(far, std::vector<float>(64 * 40, kInfinity), 1, mask);
  EXPECT_EQ(mask.width(), 64);
  EXPECT_EQ(space.unseen_cells(), cells);
  space.carve(camera(0, 64, 40), std::vector<float>(64 * 40, std::numeric_limits<float>::quiet_NaN()), 1);
  space.carve(camera(0, 64, 40), std::vector<float>(64 * 40, -1), 1);
  EXPECT_EQ(space.unseen_cells(), cells);
  // The eye is in the box: the near plane cuts blocks.
  geometry::Camera inside = camera(0, 64, 40);
  inside.pose.position_room = {0.3, 0.1, 0};
  space.carve(inside, std::vector<float>(64 * 40, kInfinity), 1);
  EXPECT_LT(space.unseen_cells(), cells);
  space.project(inside, std::vector<float>(64 * 40, kInfinity), 1, mask);
  EXPECT_LT(mask.count(), 64u * 40 / 10);
}

}  // namespace
}  // namespace telesplat::packer
