// The chunks of a tree that a view is sampled from.
#include "services/sampler/mesh/cut.h"

#include <gtest/gtest.h>

#include <set>

#include "common/geometry/trajectory.h"

namespace telesplat::sampler {
namespace {

using Ids = std::vector<uint64_t>;

// A wall of 4 x 4 leaves of 1 m, 0.01 m thin; four nodes of 2 x 2 of them above, whose vertices lie 1 cm apart; and a
// root with 4 cm. Ids: 0 to 15, 16 to 19, 20.
std::vector<geometry::ChunkInfo> wall() {
  std::vector<geometry::ChunkInfo> out;
  const auto add = [&](float x, float y, float size, float spacing_m, uint32_t first_child) {
    out.push_back({ChunkId{out.size()},
                   {{x, y, 0}, {x + size, y + size, 0.01f}},
                   100,
                   1000,
                   spacing_m,
                   first_child,
                   spacing_m > 0 ? 4u : 0u});
  };
  for (uint32_t i = 0; i < 16; ++i) add(float(i / 4 % 2 * 2 + i % 2), float(i / 8 * 2 + i / 2 % 2), 1, 0, 0);
  for (uint32_t i = 0; i < 4; ++i) add(float(i % 2 * 2), float(i / 2 * 2), 2, 0.01f, 4 * i);
  add(0, 0, 4, 0.04f, 16);
  return out;
}

// Looks at the wall's middle from this far; a pixel is 1 / 1000 of the distance wide.
geometry::Camera camera_at(double distance_m) {
  geometry::Camera out;
  out.width = out.height = 4000;
  out.left = out.bottom = -2, out.right = out.top = 2;
  out.pose = {{2, 2, distance_m}, {1, 0, 0, 0}};
  return out;
}

Cut cut_of(double distance_m, const std::set<uint64_t>& held, const geometry::Rect& part = {0, 0, 4000, 4000}) {
  const geometry::Camera camera = camera_at(distance_m);
  return choose_cut(wall(), camera, geometry::Frustum(geometry::crop(camera, part)),
                    [&](ChunkId id) { return held.contains(id.value); });
}
std::set<uint64_t> all() {
  std::set<uint64_t> out;
  for (uint64_t i = 0; i <= 20; ++i) out.insert(i);
  return out;
}
Ids values(const std::vector<ChunkId>& ids) {
  Ids out;
  for (const ChunkId id : ids) out.push_back(id.value);
  return out;
}

TEST(Cut, TakesTheLevelWhoseVerticesLieLessThanAPixelApart) {
  EXPECT_EQ(values(cut_of(58, all()).shown), (Ids{20})) << "4 cm are 0.69 pixels";
  EXPECT_EQ(values(cut_of(56, all()).shown), (Ids{16, 17, 18, 19})) << "0.71 pixels";
  EXPECT_EQ(cut_of(5, all()).shown.size(), 16u);
  EXPECT_TRUE(cut_of(5, all()).fine);
  EXPECT_TRUE(cut_of(5, all()).missing.empty());
}

TEST(Cut, IsFinerWhereTheViewIsNearer) {
  geometry::Camera camera = camera_at(16);
  camera.pose.position_room = {0, 2, 14.4};  // 1 cm is 0.7 pixels 14.3 m away: farther than the left half
  const Cut cut = choose_cut(wall(), camera, geometry::Frustum(camera), [](ChunkId) { return true; });
  EXPECT_EQ(values(cut.shown), (Ids{16, 17, 18, 19}));
  camera.pose.position_room = {0, 2, 14.2};
  const Cut nearer = choose_cut(wall(), camera, geometry::Frustum(camera), [](ChunkId) { return true; });
  EXPECT_EQ(values(nearer.shown), (Ids{0, 1, 2, 3, 8, 9, 10, 11, 17, 19}));
}

TEST(Cut, LetsTheChunkAboveStandInForOneThatIsNotHeld) {
  auto held = all();
  held.erase(5);
  const Cut cut = cut_of(5, held);
  EXPECT_EQ(values(cut.shown), (Ids{0, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15, 17}));
  EXPECT_EQ(values(cut.missing), (Ids{5}));
  EXPECT_FALSE(cut.fine);
  EXPECT_TRUE(cut.whole);
}

TEST(Cut, AsksForTheCoarsestFirst) {
  const Cut nothing = cut_of(5, {});
  EXPECT_TRUE(nothing.shown.empty());
  EXPECT_FALSE(nothing.whole);
  ASSERT_EQ(nothing.missing.size(), 21u);
  EXPECT_EQ(nothing.missing[0].value, 20u);
  for (size_t i = 1; i < 5; ++i) EXPECT_GE(nothing.missing[i].value, 16u) << i;
  const Cut root = cut_of(5, {20});
  EXPECT_EQ(values(root.shown), (Ids{20}));
  EXPECT_TRUE(root.whole);
  EXPECT_FALSE(root.fine);
  EXPECT_EQ(root.missing.size(), 20u);
}

TEST(Cut, LooksOnlyAtItsPartOfTheView) {
  const Cut corner = cut_of(1, {20}, {0, 0, 10, 10});  // rows count from the top
  EXPECT_EQ(values(corner.missing), (Ids{18, 10}));
  EXPECT_EQ(values(corner.shown), (Ids{20}));
}

TEST(Cut, DoesWithoutATree) {
  auto leaves = wall();
  leaves.resize(16);
  const geometry::Camera camera = camera_at(100);
  const Cut cut = choose_cut(leaves, camera, geometry::Frustum(camera), [](ChunkId id) { return id.value != 3; });
  EXPECT_EQ(cut.shown.size(), 15u);
  EXPECT_EQ(values(cut.missing), (Ids{3}));
  EXPECT_FALSE(cut.whole);
}

}  // namespace
}  // namespace telesplat::sampler
