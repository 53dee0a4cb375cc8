// The replica on display, its draw lists, and the reports about the clusters that they drew.
#include <gtest/gtest.h>

#include "client/viewer/points/epoch_switch.h"
#include "client/viewer/points/model_cache.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

constexpr EpochId kOne{1}, kTwo{2}, kThree{3};

// ---- EpochSwitch ----

class Switch : public testing::Test {
 protected:
  EpochSwitch s{0.15};
  void SetUp() override {
    s.begin(kOne, false, 0);
    EXPECT_FALSE(s.due(100)) << "what is on display need not be shown";
    EXPECT_EQ(s.displayed(), kOne);
  }
  void part(EpochId epoch, double now_s, uint64_t step, bool complete, bool own = true) {
    s.on_part({epoch, step, complete, own}, now_s);
  }
};

TEST_F(Switch, ACompleteFrameIsShownAtOnce) {
  s.begin(kTwo, true, 1);
  part(kTwo, 1.01, 4, true);
  EXPECT_FALSE(s.due(1.01)) << "a coarse frame is not";
  part(kTwo, 1.02, 1, false);
  EXPECT_FALSE(s.due(1.02));
  part(kTwo, 1.03, 1, true);
  EXPECT_TRUE(s.due(1.03));
  s.shown();
  EXPECT_EQ(s.displayed(), kTwo);
  EXPECT_FALSE(s.due(9));
}

TEST_F(Switch, ThePatienceNeedsNoMessageToRunOut) {
  s.begin(kTwo, true, 1);
  part(kTwo, 1.01, 4, true);
  EXPECT_FALSE(s.due(1.149));
  EXPECT_TRUE(s.due(1.15));
}

TEST_F(Switch, HalfACoarseFrameIsNotShownHoweverLate) {
  s.begin(kTwo, true, 1);
  EXPECT_FALSE(s.due(9)) << "there is nothing";
  part(kTwo, 9, 4, false);
  EXPECT_FALSE(s.due(9));
  part(kTwo, 9.1, 4, true);
  EXPECT_TRUE(s.due(9.1));
}

TEST_F(Switch, WithoutACoarsePassAnyPartIsShownAfterThePatience) {
  s.begin(kTwo, true, 1);
  part(kTwo, 1.1, 1, false);
  EXPECT_FALSE(s.due(1.14));
  EXPECT_TRUE(s.due(1.16));
}

TEST_F(Switch, WhatAnotherViewerAskedForWaitsForThePatience) {
  s.begin(kTwo, true, 1);
  part(kTwo, 1.05, 1, true, false);
  EXPECT_FALSE(s.due(1.1));
  EXPECT_TRUE(s.due(1.15));
}

TEST_F(Switch, EpochsThatSupersedeEachOtherDoNotRestartTheClock) {
  double now = 1;
  for (uint64_t e = 2; e < 6; ++e, now += 0.05) {
    s.begin({e}, true, now);
    EXPECT_FALSE(s.due(now)) << "an empty one";
  }
  EXPECT_EQ(s.waiting_since_s(), 1.0);
  part({5}, now, 4, true);
  EXPECT_TRUE(s.due(now)) << now;
  s.shown();
  EXPECT_EQ(s.displayed(), (EpochId{5}));
  s.begin({6}, true, now);
  EXPECT_EQ(s.waiting_since_s(), now) << "the next one has its own patience";
}

TEST_F(Switch, ARestartedPackerOfTheSameSceneWaitsForACompleteFrame) {
  s.begin({}, true, 1);
  part(kOne, 1.1, 4, true);
  part(kOne, 1.2, 1, false);
  EXPECT_FALSE(s.due(60));
  part(kOne, 61, 1, true, false);
  EXPECT_TRUE(s.due(61));
}

TEST_F(Switch, ARestartedPackersFirstPartTellsOfAnotherEpoch) {
  s.begin({}, true, 1);
  EXPECT_FALSE(s.waiting_since_s().has_value());
  part(kTwo, 2, 4, true);
  EXPECT_FALSE(s.due(2.1));
  EXPECT_TRUE(s.due(2.15));
}

TEST_F(Switch, AnEpochDuringARestartGetsItsOwnClock) {
  s.begin({}, true, 1);
  s.begin(kTwo, true, 5);
  part(kTwo, 5.1, 1, false);
  EXPECT_FALSE(s.due(5.1));
  EXPECT_TRUE(s.due(5.15));
}

// ---- ModelCache ----

class Cache : public testing::Test {
 protected:
  const points::ModelConfig config = test::scene_config();
  const geometry::Camera camera = test::scene_camera({0, 0.3, 0.8}, 48, 32);
  ModelCache cache;
  splat::DrawList list;
  uint64_t next = 1;

  void insert(EpochId epoch, uint64_t frame = 1) {
    const geometry::Rect whole{0, 0, camera.width, camera.height};
    cache.insert(points::prepare_patch(config, {next++}, camera, whole, test::sample_scene(camera, whole), {frame}),
                 epoch);
  }
  const splat::DrawList& select() {
    cache.select(camera, {}, list);
    return list;
  }
};

TEST_F(Cache, DisplaysTheOldReplicaUntilTheNewestIsShown) {
  EXPECT_EQ(select().points, 0u);
  cache.end_frame();
  EXPECT_FALSE(cache.begin_replica(config));
  insert(kOne);
  EXPECT_EQ(select().epoch, kOne);
  EXPECT_EQ(list.applied.value, 1u);
  const uint64_t first = list.replica;
  cache.end_frame();

  EXPECT_TRUE(cache.begin_replica(config, kTwo, {next++}));
  EXPECT_EQ(cache.epoch(), kTwo);
  insert(kTwo);
  EXPECT_EQ(select().epoch, kOne);
  EXPECT_EQ(list.applied.value, 1u) << "what was applied to the newest is not displayed";
  EXPECT_EQ(list.replica, first);
  EXPECT_GT(list.points, 0u);
  cache.end_frame();

  EXPECT_TRUE(cache.begin_replica(config, kThree, {next++}));
  insert(kThree);
  EXPECT_EQ(select().epoch, kOne) << "a third one supersedes the second";
  cache.end_frame();
  cache.show_newest();
  EXPECT_EQ(select().epoch, kThree);
  EXPECT_EQ(list.applied.value, next - 1);
  EXPECT_NE(list.replica, first);
  cache.end_frame();
}

TEST_F(Cache, NothingIsHeldWhereNothingIsDisplayed) {
  EXPECT_FALSE(cache.begin_replica(config, kOne, {1}));
  EXPECT_FALSE(cache.begin_replica(config, kTwo, {2}));
  insert(kTwo);
  EXPECT_EQ(select().epoch, kTwo) << "a late joiner sees what is there at once";
  EXPECT_GT(list.points, 0u);
  cache.end_frame();
}

TEST_F(Cache, WhatAFrameDrawsLivesUntilItsEnd) {
  cache.begin_replica(config);
  insert(kOne);
  std::vector<points::ClusterKey> keys;
  const auto sum = [&] {
    uint64_t s = 0;
    for (const auto& item : list.items) {
      s += item.cluster->key;
      for (uint32_t i = 0; i < item.level.count; ++i) s += item.level.colour[i] + item.level.x[i];
    }
    return s;
  };
  select();
  const uint64_t before = sum();
  ASSERT_GT(list.clusters_seen.size(), 2u);
  cache.forget({next++}, std::span(list.clusters_seen).first(2));
  cache.begin_replica(config, kTwo, {next++});
  insert(kTwo);
  cache.show_newest();
  cache.begin_replica(config, kThree, {next++});
  insert(kThree);
  cache.show_newest();
  cache.free_dropped();
  EXPECT_EQ(sum(), before);  // the address sanitizer finds clusters that were freed too early
  cache.end_frame();
  EXPECT_EQ(select().epoch, kThree);
  cache.end_frame();
}

TEST_F(Cache, FiguresTellOfTheNewestAndOfTheDisplayed) {
  cache.begin_replica(config);
  insert(kOne);
  const uint64_t points = cache.figures().points;
  EXPECT_GT(points, 0u);
  cache.begin_replica(config, kTwo, {next++});
  EXPECT_EQ(cache.figures().points, 0u);
  EXPECT_EQ(cache.figures().points_displayed, points);
}

// ---- AccessLog ----

TEST(AccessLog, ReportsEveryClusterOnce) {
  AccessLog log;
  EXPECT_TRUE(log.reports().empty());
  for (int frame = 0; frame < 3; ++frame) log.add(std::vector<uint32_t>{7, 3, 5}, {});
  log.add(std::vector<uint32_t>{4}, {});
  const auto reports = log.reports();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].clusters, (std::vector<uint32_t>{3, 4, 5, 7}));
  EXPECT_TRUE(reports[0].frames.empty());
  EXPECT_TRUE(log.reports().empty()) << "told already";
}

TEST(AccessLog, ReportsEveryPatchOnce) {
  AccessLog log;
  log.add(std::vector<uint32_t>{7, 7, 3}, std::vector<uint32_t>{2, 1, 9});
  log.add(std::vector<uint32_t>{7, 3}, std::vector<uint32_t>{2, 8});
  const auto reports = log.reports();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].clusters, (std::vector<uint32_t>{3, 3, 7, 7}));
  EXPECT_EQ(reports[0].frames, (std::vector<uint32_t>{8, 9, 1, 2}));
  log.add(std::vector<uint32_t>{1}, std::vector<uint32_t>{1});
  log.add(std::vector<uint32_t>{2}, {});  // the session's packing changed
  const auto changed = log.reports();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0].clusters, std::vector<uint32_t>{2});
  EXPECT_TRUE(changed[0].frames.empty());
}

TEST(AccessLog, LongReportsAreCut) {
  AccessLog log;
  std::vector<uint32_t> clusters(AccessLog::kMaxInReport + 3), frames(clusters.size(), 5);
  for (size_t i = 0; i < clusters.size(); ++i) clusters[i] = uint32_t(i);
  log.add(clusters, frames);
  const auto reports = log.reports();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[0].clusters.size(), AccessLog::kMaxInReport);
  EXPECT_EQ(reports[1].clusters, (std::vector<uint32_t>{65536, 65537, 65538}));
  EXPECT_EQ(reports[1].frames.size(), 3u);
}

}  // namespace
}  // namespace telesplat::viewer
