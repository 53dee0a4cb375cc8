// The planner's view of the model serves returning tiles: they are compared with it as with the model.
#include <gtest/gtest.h>

#include "services/packer/points/plan/planned_frame.h"
#include "services/packer/points/plan/planner.h"
#include "tests/support/packer_scenes.h"
#include "tests/support/planned_tiles.h"

namespace telesplat::packer {
namespace {

const geometry::Camera kFirst = test::scene_camera({0.7, 0.4, 0}, 192, 128);
const geometry::Camera kBeside = test::scene_camera({0.69, 0.41, 0.03}, 208, 138);
const geometry::Camera kFartherBeside = test::scene_camera({0.68, 0.42, 0.06}, 240, 160);
const geometry::Camera kOther = test::scene_camera({0.6, 0.5, 0.3}, 192, 128);

// Two packers of the same tiles: only one knows the plan.
class PlannedTiles : public testing::Test {
 protected:
  PlannedTiles() {
    with.watch(&planner);
    submit_frame(kFirst, {1});
  }
  void submit_frame(const geometry::Camera& camera, FrameId id) {
    for (SampledTile& tile : test::sampled_frame(id, camera, 64)) {
      planner.take(tile, true, 0);
      ASSERT_TRUE(with.submit(tile, 0).ok());
      ASSERT_TRUE(without.submit(std::move(tile), 0).ok());
    }
    while (planner.settle()) {
    }
  }
  wire::PlanRequest request(FrameId id) const {
    return {
        .frame = id, .epoch = test::kEpoch, .viewer = {77}, .request = {id.value}, .camera = kBeside, .tile_size = 64};
  }
  wire::Plan plan(FrameId id) { return planner.plan(with.model(), with.sequence(), request(id), 1); }
  std::vector<SampledTile> sample(const wire::Plan& plan) const {
    std::vector<SampledTile> out;
    for (test::PlannedTile& planned : test::planned_tiles(request(plan.frame), plan))
      out.push_back(std::move(planned.tile));
    return out;
  }

  Planner planner{{.model = test::packer_config().model}};
  PackerCore with{test::packer_config(), test::kEpoch}, without{test::packer_config(), test::kEpoch};
};

TEST_F(PlannedTiles, AreComparedWithWhatThePlanHasSeen) {
  const wire::Plan planned = plan({2});
  ASSERT_FALSE(planned.full);
  const auto tiles = sample(planned);
  ASSERT_GT(tiles.size(), 2u);
  uint64_t kept = 0, samples = 0;
  for (size_t i = 0; i < tiles.size(); ++i) {
    // Another view's points come in between: surfaces that they show are not kept again.
    if (i == tiles.size() / 2) submit_frame(kOther, {3});
    planner.take(tiles[i], false, 1);
    const auto reference = planner.reference(tiles[i]);
    ASSERT_TRUE(reference.has_value());
    const auto a = with.submit(tiles[i], 1, {}, {}, reference), b = without.submit(tiles[i], 1);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ((*a)->samples, (*b)->samples);
    EXPECT_NEAR(double((*a)->kept), double((*b)->kept), 2) << "a camera of the tile alone rounds otherwise";
    kept += (*a)->kept, samples += (*a)->samples;
  }
  EXPECT_GT(kept, 20u);
  EXPECT_LT(kept, samples);
}

// Their sampler died, or a newer view went first.
TEST_F(PlannedTiles, OfFramesThatAreGivenUpAreNotRemembered) {
  const auto tiles = sample(plan({2}));
  ASSERT_GT(tiles.size(), 1u);
  EXPECT_EQ(planner.frames(), 1u);
  planner.take(tiles[0], false, 1);
  planner.plan(with.model(), with.sequence(), request({3}), 5);
  EXPECT_TRUE(planner.reference(tiles[1]).has_value()) << "it may still come";
  planner.plan(with.model(), with.sequence(), request({4}), 12);
  EXPECT_FALSE(planner.reference(tiles[1]).has_value());
  EXPECT_EQ(planner.frames(), 2u);
}

TEST_F(PlannedTiles, AreComparedWithTheModelWhereThePlanDoesNotKnow) {
  const wire::Plan planned = plan({2});
  auto tiles = sample(planned);
  ASSERT_GT(tiles.size(), 2u);
  SampledTile more = tiles[0];
  more.image = test::sample_scene(more.camera, more.rect);
  EXPECT_FALSE(planner.reference(more)) << "sampled without its mask";
  SampledTile unknown = tiles[0];
  unknown.frame = {99};
  EXPECT_FALSE(planner.reference(unknown));
  EXPECT_TRUE(planner.reference(tiles[0]));
  const std::vector<points::ClusterKey> some{with.model().clusters().begin()->first};
  with.forget(some);
  EXPECT_FALSE(planner.reference(tiles[0])) << "the model shows less now";
}

// The master gave them up for a newer view, and the next question dropped their masks.
TEST_F(PlannedTiles, ThatComeAfterTheyWereGivenUpAreComparedWithTheModel) {
  wire::PlanRequest beside = request({2});
  beside.extra = true;
  const wire::Plan given_up = planner.plan(with.model(), with.sequence(), beside, 1);
  auto tiles = test::planned_tiles(beside, given_up);
  ASSERT_FALSE(tiles.empty());
  EXPECT_TRUE(planner.reference(tiles[0].tile));
  beside.frame = {3}, beside.round = 1;
  planner.plan(with.model(), with.sequence(), beside, 1.6);
  for (const test::PlannedTile& late : tiles) {
    planner.take(late.tile, late.whole, 1.7);
    EXPECT_FALSE(planner.reference(late.tile));
  }
}

TEST_F(PlannedTiles, AViewIsUnderWayUntilItIsCompleteOrOld) {
  EXPECT_FALSE(planner.view_under_way(1));
  const auto tiles = sample(plan({2}));
  EXPECT_TRUE(planner.view_under_way(1));
  EXPECT_FALSE(planner.view_under_way(2)) << "it may have been given up";
  for (const SampledTile& tile : tiles) planner.take(tile, false, 1);
  EXPECT_FALSE(planner.view_under_way(1));
}

TEST_F(PlannedTiles, AreNoneOfAViewThatNeedsAQuarterOfItsRays) {
  wire::PlanRequest farther = request({2});
  farther.camera = kFartherBeside;
  const wire::Plan whole = planner.plan(with.model(), with.sequence(), farther, 1);
  double rays = 0;
  for (const char* c : {"nothing", "edge", "sparse", "stale", "unproven"})
    rays += whole.figures.at(std::string("rays.") + c);
  const double pixels = 240.0 * 160;
  EXPECT_GT(rays, pixels / 4);
  EXPECT_LT(rays, pixels / 2);
  EXPECT_TRUE(whole.full) << "rays of masks would cost more";
  EXPECT_TRUE(whole.tiles.empty());
}

TEST_F(PlannedTiles, RaysThatOnlyRefineAreLimited) {
  wire::PlanRequest finer{.frame = {2},
                          .epoch = test::kEpoch,
                          .viewer = {77},
                          .request = {2},
                          .camera = test::scene_camera({0.7, 0.4, 0}, 576, 384),
                          .tile_size = 64};
  const wire::Plan all = planner.plan(with.model(), with.sequence(), finer, 1);
  EXPECT_GT(all.figures.at("rays.sparse"), 20'000) << "most pixels lack a sample";
  finer.frame = {3}, finer.most_rays = 3000;
  const wire::Plan some = planner.plan(with.model(), with.sequence(), finer, 2);
  ASSERT_FALSE(some.full);
  EXPECT_LE(some.figures.at("rays.sparse"), 3000);
  EXPECT_GT(some.figures.at("rays.sparse"), 1000);
  EXPECT_GT(some.figures.at("rays.put_off"), 10'000);
  EXPECT_LE(some.figures.at("rays.edge"), 12'000);
  EXPECT_GT(some.figures.at("rays.edge"), 10'000) << "more of those";
  EXPECT_EQ(some.figures.at("rays.sparse") + some.figures.at("rays.edge") + some.figures.at("rays.put_off"),
            all.figures.at("rays.sparse") + all.figures.at("rays.edge"));
  EXPECT_EQ(some.figures.at("rays.nothing"), all.figures.at("rays.nothing")) << "those are not put off";
}

TEST(PutOffRays, LeavesThoseNearTheMiddle) {
  image::PixelMask some(320, 192), cast(320, 192);
  for (int y = 0; y < 192; ++y)
    for (int x = 0; x < 320; ++x) {
      cast.set(x, y);
      if (x % 2 == 0) some.set(x, y);
    }
  image::PixelMask left = cast;
  EXPECT_EQ(put_off_rays(some, some.count(), left), 0u);
  EXPECT_TRUE(left == cast);
  const uint64_t taken = put_off_rays(some, 3 * 512 + 100, left);
  EXPECT_EQ(some.count() - taken, 3u * 512);
  EXPECT_EQ(cast.count() - left.count(), taken);
  EXPECT_TRUE(left.at(160, 96));
  EXPECT_FALSE(left.at(0, 0));
  EXPECT_TRUE(left.at(1, 0)) << "not one of them";
}

}  // namespace
}  // namespace telesplat::packer
