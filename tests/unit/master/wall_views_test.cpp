// Views of a wall's viewers are sampled as one frame; a late, new or departed viewer delays the others only briefly.
#include "services/master/slabs/schedule.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>

namespace telesplat::master {
namespace {

wire::ViewRequest view(uint64_t viewer, uint64_t ask, double now_s) {
  wire::ViewRequest r;
  r.viewer = {100 + viewer};
  r.request = {ask + 1};
  // Heads that are apart: the ask's number says which views belong together.
  r.camera = geometry::make_camera({.position_room = {0.4 + 0.1 * double(viewer), 0.4, 3}}, 60, 64, 48);
  r.moments.received_s = now_s;
  r.wall = "lab";
  r.wall_viewers = 4;
  r.ask = ask;
  return r;
}

class WallFrames : public ::testing::Test {
 protected:
  WallFrames() {
    volume::Grid grid;
    grid.size = {16, 16, 24};
    grid.index_to_room[0][0] = grid.index_to_room[1][1] = grid.index_to_room[2][2] = 0.05;
    schedule.set_grid(grid);
    partition->number = 1;
    partition->slabs = {{.sampler = "a", .range = {0, 24}}};
  }
  void ask(std::initializer_list<uint64_t> viewers, uint64_t number, double now_s) {
    for (const uint64_t v : viewers) schedule.request_view(view(v, number, now_s));
  }
  // Begins the next frame, samples it at once, and returns its views.
  std::set<uint64_t> begin(double now_s) {
    if (!schedule.begin_frame({1}, partition, false, now_s)) return {};
    const auto lease = schedule.lease("a", now_s);
    EXPECT_TRUE(lease);
    std::set<uint64_t> out;
    for (const auto& v : lease->views) out.insert(v.viewer.value - 100);
    wire::TileDone done;
    done.frame = lease->frame, done.tile = lease->slab, done.lease = lease->lease;
    EXPECT_TRUE(schedule.tile_done(done, now_s));
    return out;
  }
  // Lets all four have a frame of the first ask.
  void begin_wall() {
    ask({0, 1, 2, 3}, 1, 1);
    ASSERT_EQ(begin(1), all);
  }

  const std::set<uint64_t> all{0, 1, 2, 3};
  VolumeSchedule schedule{{.frames_in_flight = 2, .lease_timeout_s = 2}};
  std::shared_ptr<Partition> partition = std::make_shared<Partition>();
};

TEST_F(WallFrames, ViewsOfOneAskAreOneFrame) {
  begin_wall();
  ask({0, 1, 2}, 2, 2);
  EXPECT_TRUE(begin(2.001).empty()) << "the fourth may come yet";
  ask({3}, 2, 2.002);
  EXPECT_EQ(begin(2.002), all);
  EXPECT_TRUE(begin(2.1).empty());
}

TEST_F(WallFrames, AViewOfTheAskBeforeWaitsForItsNewerOne) {
  begin_wall();
  ask({0, 1, 2, 3}, 2, 2);
  ask({0, 1}, 3, 2.005);
  EXPECT_TRUE(begin(2.006).empty());
  ask({2, 3}, 3, 2.01);
  EXPECT_EQ(begin(2.01), all);
}

TEST_F(WallFrames, ALateOneHoldsTheOthersOnce) {
  begin_wall();
  ask({0, 1, 2}, 2, 2);
  EXPECT_TRUE(begin(2 + WallViews::kTogether_s - 0.001).empty());
  EXPECT_EQ(begin(2 + WallViews::kTogether_s), (std::set<uint64_t>{0, 1, 2}));
  ask({0, 1, 2}, 3, 2.05);
  EXPECT_EQ(begin(2.05), (std::set<uint64_t>{0, 1, 2})) << "it is not waited for";
  double now_s = 2.1;
  for (uint64_t number = 4; number < 4 + WallViews::kInTime; ++number, now_s += 0.05) {
    ask({3, 0, 1, 2}, number, now_s);
    EXPECT_EQ(begin(now_s), all);
  }
  ask({0, 1, 2}, 10, now_s);
  EXPECT_TRUE(begin(now_s).empty()) << "it is waited for again";
}

TEST_F(WallFrames, WhatIsLateByAFrameHasOneOfItsOwnAfterAWhile) {
  begin_wall();
  ask({0, 1, 2}, 2, 2);
  EXPECT_EQ(begin(2.1).size(), 3u);
  ask({3}, 2, 2.11);
  EXPECT_TRUE(begin(2.12).empty());
  ask({3}, 2, 2.2);
  EXPECT_EQ(begin(2.11 + WallViews::kLeftOver_s), std::set<uint64_t>{3});
}

TEST_F(WallFrames, ViewersThatComeTogetherBeginTogether) {
  ask({0, 1}, 0, 1);
  EXPECT_TRUE(begin(1.5).empty());
  ask({0, 1, 2}, 0, 1.6);
  EXPECT_TRUE(begin(1.6).empty());
  ask({3}, 0, 1.7);
  EXPECT_EQ(begin(1.7), all);
  ask({0, 1}, 0, 1.75);
  EXPECT_TRUE(begin(1.751).empty());
  ask({2, 3}, 0, 1.76);
  EXPECT_EQ(begin(1.76), all);
}

TEST_F(WallFrames, OneThatNeverComesIsNotWaitedForForEver) {
  ask({0, 1, 2}, 0, 1);
  EXPECT_TRUE(begin(1 + WallViews::kGather_s - 0.01).empty());
  EXPECT_EQ(begin(1 + WallViews::kGather_s).size(), 3u);
  ask({0, 1, 2}, 1, 3);
  EXPECT_EQ(begin(3).size(), 3u);
}

TEST_F(WallFrames, WhoIsGoneOrNewHoldsNobody) {
  begin_wall();
  ask({0, 1, 2}, 2, 2);
  schedule.forget_viewer({103});
  EXPECT_EQ(begin(2), (std::set<uint64_t>{0, 1, 2}));
  ask({7}, 0, 2.04);
  ask({0, 1, 2}, 3, 2.05);
  EXPECT_EQ(begin(2.05), (std::set<uint64_t>{0, 1, 2})) << "it has not heard of the others' ask";
  EXPECT_TRUE(begin(2.06).empty());
  EXPECT_EQ(begin(2.04 + WallViews::kLeftOver_s), std::set<uint64_t>{7});
}

TEST_F(WallFrames, ADroppedFrameIsSampledForAllAgain) {
  begin_wall();
  ask({0, 1, 2, 3}, 2, 2);
  ASSERT_TRUE(schedule.begin_frame({1}, partition, false, 2));
  schedule.drop_frames();
  EXPECT_EQ(begin(2.001), all);
}

TEST_F(WallFrames, OtherViewersAndThoseThatTakeViewsInOrderDoNotWait) {
  auto single = view(9, 0, 1);
  single.wall.clear();
  schedule.request_view(single);
  EXPECT_EQ(begin(1), std::set<uint64_t>{9});
  auto in_order = view(8, 0, 1);
  in_order.buffers = 2;
  schedule.request_view(in_order);
  EXPECT_EQ(begin(1), std::set<uint64_t>{8});
}

}  // namespace
}  // namespace telesplat::master
