// The planner's memory of viewers and of frames under way: it is bounded, however many come and go, and becomes void
// only for viewers that may see the forgotten leaves.
#include "services/packer/points/plan/planned_frame.h"

#include <gtest/gtest.h>

#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

using points::ClusterKey;

std::shared_ptr<ViewMap> map_of(const geometry::Camera& camera) {
  auto out = std::make_shared<ViewMap>();
  out->camera = camera;
  return out;
}

geometry::Camera camera_of(int width, int height) { return test::scene_camera({0.6, 0.3, 0.2}, width, height); }

TEST(ViewerViews, MapsOfTheViewersThatAskedLastAreKept) {
  ViewerViews views;
  for (uint64_t id = 1; id <= 1000; ++id) {
    ViewerView& v = views.use({id});
    EXPECT_FALSE(v.known);
    follow(camera_of(64, 48), v);
    v.map = map_of(v.camera);
    if (id % 2) v.fine_map = map_of(v.camera);
    EXPECT_LE(views.size(), ViewerViews::kMaxViewers);
    EXPECT_LE(views.map_pixels(), 64u * 48 * (ViewerViews::kMaxMaps + 2)) << "and those of the one at hand";
    EXPECT_EQ(&views.use({id}), views.find({id}));
  }
  EXPECT_TRUE(views.find({1000})->map);
  EXPECT_TRUE(views.find({997})->map);
  EXPECT_FALSE(views.find({990})->map || views.find({991})->fine_map);
  EXPECT_FALSE(views.find({1000 - ViewerViews::kMaxViewers}));
}

TEST(ViewerViews, LargeMapsAreFewer) {
  ViewerViews views;
  for (uint64_t id = 1; id <= 20; ++id) {
    ViewerView& v = views.use({id});
    v.camera = camera_of(4096, 4096);
    v.map = map_of(v.camera), v.fine_map = map_of(v.camera);
    views.use({id});
    EXPECT_LE(views.map_pixels(), ViewerViews::kMaxMapPixels);
    EXPECT_TRUE(v.map && v.fine_map);
    EXPECT_LE(views.size(), ViewerViews::kMaxViewPixels / (4096 * 4096));
  }
}

ClusterKey leaf_at(const points::ModelConfig& model, const glm::dvec3& p) {
  const points::OctreeGrid grid = points::octree_grid(model);
  const glm::uvec3 at((p - grid.lo) / grid.leaf_size);
  return at.x | at.y << 10 | at.z << 20;
}

TEST(ViewerViews, OnlyViewsThatMaySeeWhatWasForgottenLoseTheirCasts) {
  const points::ModelConfig model = test::scene_config(6);
  const geometry::Camera front = test::scene_camera({0, 0.1, 0.32}, 160, 120),
                         side = test::scene_camera({0.35, 0.1, 0}, 160, 120);
  ViewerViews views;
  for (const auto& [id, camera] : {std::pair{1, front}, {2, side}, {3, side}}) {
    ViewerView& v = views.use({uint64_t(id)});
    if (id < 3) follow(camera, v);
  }
  const auto forget = [&](const std::vector<ClusterKey>& leaves, double around_m = 0) {
    for (uint64_t id : {1, 2}) views.find({id})->done.set(5, 5), views.find({id})->cells_done = 7;
    views.forgotten(model, around_m, leaves);
    for (uint64_t id : {1, 2}) EXPECT_EQ(views.find({id})->cells_done != 0, views.find({id})->done.at(5, 5));
    return std::pair(!views.find({1})->done.at(5, 5), !views.find({2})->done.at(5, 5));
  };
  const ClusterKey middle = leaf_at(model, {0, 0, 0}), behind_front = leaf_at(model, {-0.3, 0.1, 0.36}),
                   behind_side = leaf_at(model, {0.385, 0.1, -0.3});
  EXPECT_EQ(forget({middle}), std::pair(true, true));
  EXPECT_EQ(forget({behind_front}), std::pair(false, true));
  EXPECT_EQ(forget({behind_side}), std::pair(true, false));
  EXPECT_EQ(forget({behind_front, behind_side}), std::pair(true, true));
  EXPECT_EQ(forget({behind_front}, 0.2), std::pair(true, true)) << "rays from beside go farther";
  EXPECT_EQ(forget({}), std::pair(false, false));
  // Splats reach beyond their leaf: the border of the view is 1 cm away.
  EXPECT_EQ(forget({leaf_at(model, {0.2, 0, 0})}).first, true);
}

TEST(FrameShelf, WhatIsUnderWayIsBoundedByWhatItTakes) {
  FrameShelf shelf;
  const auto sum = [&] {
    size_t held = 0;
    for (const PlannedFrame& f : shelf.frames()) held += FrameShelf::held(f);
    return held;
  };
  for (uint64_t id = 1; id <= 500; ++id) {
    PlannedFrame frame{.id = {id}, .viewer = {id}, .camera = camera_of(2048, 2048)};
    switch (id % 3) {
      case 0:
        frame.whole = true, frame.whole_m.resize(2048 * 2048);
        break;
      case 1:  // many rays, no map of depths
        for (int y = 0; y < 2048; y += 256)
          frame.tiles.push_back({{0, y, 2048, 256}, image::PixelMask(2048, 256), 2048u * 256u});
        break;
      default:  // few rays
        frame.tiles.push_back({{0, 0, 2048, 2048}, image::PixelMask(2048, 2048), 1});
    }
    shelf.add(std::move(frame));
    EXPECT_LE(shelf.frames().size(), FrameShelf::kMaxFrames);
    EXPECT_LE(sum(), FrameShelf::kMaxPixels);
    EXPECT_TRUE(shelf.find({id}));
  }
  EXPECT_GT(sum(), FrameShelf::kMaxPixels / 2);
}

}  // namespace
}  // namespace telesplat::packer
