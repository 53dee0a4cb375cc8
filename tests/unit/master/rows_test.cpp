// Leases of rows, coarse passes and backups, without sockets and clocks.
#include <gtest/gtest.h>

#include <random>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

wire::ViewRequest request(uint64_t viewer, uint64_t id, int width = 640, int height = 400) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.camera.width = width;
  r.camera.height = height;
  return r;
}

wire::TileDone done(const wire::Lease& l, double took_s = 0) {
  wire::TileDone m;
  m.frame = l.frame;
  m.tile = l.tile;
  m.lease = l.lease;
  m.step = l.step;
  m.rect = l.rect;
  m.moments.leased_s = m.moments.sample_begin_s = l.moments.leased_s;
  m.moments.sample_end_s = m.moments.encode_end_s = l.moments.leased_s + took_s;
  return m;
}

const auto kNobody = [](const std::string&) {};

// Leases to "a", or, if only an idle sampler gets a lease, to "b".
std::optional<wire::Lease> lease_any(FrameSchedule& s) {
  const auto l = s.lease("a", 0);
  return l ? l : s.lease("b", 0);
}

FrameSchedule by_rows(ScheduleOptions options = {}, bool coarse = false) {
  FrameSchedule s(options);
  s.set_cut({true, coarse});
  return s;
}

TEST(CutBlocks, CoverTheFrameFromTheMiddle) {
  for (const int height : {1, 63, 64, 65, 640, 1000, geometry::kMaxImageSide}) {
    std::vector<int> covered(size_t(height), 0);
    double last = -1;
    for (const auto& b : cut_blocks(100, height)) {
      EXPECT_EQ(b.x, 0);
      EXPECT_EQ(b.width, 100);
      EXPECT_LE(b.height, kBlockRows);
      for (int y = b.y; y < b.y + b.height; ++y) ++covered[size_t(y)];
      const double distance = std::abs(b.y + b.height / 2.0 - height / 2.0);
      EXPECT_GE(distance, last);
      last = distance;
    }
    EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), height);
  }
}

TEST(BandRows, TakeTheTargetButNoMoreThanAThirdOfAnEqualShare) {
  EXPECT_EQ(band_rows(0.004, 0, 640, 2), 1) << "nothing is known";
  EXPECT_EQ(band_rows(0.004, 0.001, 640, 2), 4);
  EXPECT_EQ(band_rows(0.004, 0.0015, 640, 2), 3) << "rounded";
  EXPECT_EQ(band_rows(0.004, 0.1, 640, 2), 1) << "never none";
  EXPECT_EQ(band_rows(0.004, 1e-9, 640, 2), 107) << "640 / 6, rounded up";
  EXPECT_EQ(band_rows(0.004, 0.001, 18, 2), 3);
  EXPECT_EQ(band_rows(0.004, 0.001, 640, 40), 4);
  EXPECT_EQ(band_rows(0.004, 0.001, 240, 40), 2);
  EXPECT_EQ(band_rows(0.004, 0.001, 1, 40), 1);
  EXPECT_EQ(band_rows(0.004, 1e-300, 16384, 1), 5462);
  EXPECT_EQ(band_rows(0.004, 0.001, 0, 0), 1);
}

TEST(SamplingCosts, AreEachSamplersOwnOnceItHasSome) {
  SamplingCosts c;
  c.learn("stranger", 1, 1);
  EXPECT_EQ(c.pixel_s("stranger"), 0);
  c.join("a");
  c.join("b");
  EXPECT_EQ(c.pixel_s("a"), 0);
  EXPECT_FALSE(c.knows("a"));
  c.learn("a", 2, 1000);
  EXPECT_TRUE(c.knows("a"));
  EXPECT_FALSE(c.knows("b") || c.knows("stranger"));
  EXPECT_DOUBLE_EQ(c.pixel_s("a"), 0.002);
  EXPECT_DOUBLE_EQ(c.pixel_s("b"), 0.002) << "that of all";
  for (const double bad : {0.0, -1.0, std::nan("")}) c.learn("b", bad, 1000);
  EXPECT_DOUBLE_EQ(c.pixel_s("b"), 0.002);
  c.learn("b", 10, 1000);
  EXPECT_DOUBLE_EQ(c.pixel_s("b"), 0.01);
  EXPECT_DOUBLE_EQ(c.pixel_s("a"), 0.002);
  for (int i = 0; i < 100; ++i) c.learn("a", 20, 1000);
  EXPECT_NEAR(c.pixel_s("a"), 0.02, 1e-5) << "it follows";
  EXPECT_EQ(c.samplers(), 2u);
  c.leave("b");
  EXPECT_EQ(c.samplers(), 1u);
}

TEST(Rows, LeasesFollowEachSamplersMeasuredSpeed) {
  auto s = by_rows({.frames_in_flight = 1});
  // "fast" takes 0.4 ms for a row, "slow" 4 ms.
  std::map<std::string, double> row_s{{"fast", 0.0004}, {"slow", 0.004}};
  std::map<std::string, int> most;
  double now = 0;
  for (uint64_t i = 1; i <= 4; ++i) {
    s.request_view(request(1, i));
    ASSERT_TRUE(s.begin_view({1}));
    most.clear();
    bool first = true;
    while (s.frames_in_flight())
      for (const auto& [name, cost] : row_s)
        if (const auto l = s.lease(name, now)) {
          if (i == 1 && first) {
            EXPECT_EQ(l->rect.height, 1) << "nothing is known yet";
          }
          first = false;
          most[name] = std::max(most[name], l->rect.height);
          now += 1e-4;
          EXPECT_TRUE(s.tile_done(done(*l, cost * l->rect.height), name, now));
        }
  }
  EXPECT_EQ(most["fast"], 10);
  EXPECT_EQ(most["slow"], 1);
}

TEST(Rows, BandsShrinkTowardsTheEndOfAFrame) {
  auto s = by_rows({.frames_in_flight = 1, .lease_target_s = 1});
  double now = 0;
  std::vector<int> heights;
  for (uint64_t i = 1; i <= 2; ++i) {
    s.request_view(request(1, i, 640, 640));
    ASSERT_TRUE(s.begin_view({1}));
    heights.clear();
    for (int k = 0; s.frames_in_flight(); ++k) {
      const std::string name = k % 2 ? "a" : "b";
      const auto l = s.lease(name, now);
      ASSERT_TRUE(l);
      heights.push_back(l->rect.height);
      s.tile_done(done(*l, 0.001 * l->rect.height), name, now += 0.001);
    }
  }
  EXPECT_EQ(heights.front(), 64) << "a block at most";
  int left = 640;
  for (const int h : heights) {
    EXPECT_LE(h, (left + 5) / 6);
    left -= h;
  }
  EXPECT_EQ(heights.back(), 1);
  EXPECT_LT(heights.size(), 60u) << "large bands first";
}

TEST(Rows, ATakenBackBandIsLeasedWholeUnderItsNumber) {
  auto s = by_rows({.frames_in_flight = 1});
  s.request_view(request(1, 1));
  s.begin_view({1});
  const auto a = s.lease("a", 0);
  ASSERT_TRUE(a);
  EXPECT_EQ(s.release_sampler("a"), 1);
  const auto b = s.lease("b", 0);
  ASSERT_TRUE(b);
  EXPECT_EQ(b->tile, a->tile);
  EXPECT_EQ(b->rect, a->rect);
  EXPECT_NE(b->lease, a->lease);
}

TEST(Rows, WhatASamplerLetRunOutGoesToOthersFirst) {
  auto s = by_rows({.frames_in_flight = 1, .lease_timeout_s = 1});
  s.request_view(request(1, 1, 64, 1));
  s.begin_view({1});
  const auto a = s.lease("a", 0);
  ASSERT_TRUE(a);
  EXPECT_EQ(s.expire(2, kNobody), 1);
  EXPECT_FALSE(s.lease("a", 2, false));
  EXPECT_EQ(s.lease("a", 2, true)->tile, a->tile) << "better than nobody";
  EXPECT_EQ(s.expire(4, kNobody), 1);
  EXPECT_EQ(s.lease("b", 4, false)->tile, a->tile);
}

TEST(Rows, HugeFramesAreBounded) {
  auto s = by_rows();
  s.request_view(request(1, 1, geometry::kMaxImageSide, geometry::kMaxImageSide));
  s.begin_view({1});
  size_t tiles = 0;
  while (const auto l = lease_any(s)) {
    EXPECT_LT(l->tile, wire::kMaxTiles);
    EXPECT_LT(l->block, l->blocks_in_frame);
    EXPECT_LE(l->blocks_in_frame, 256u);
    ++tiles;
  }
  EXPECT_EQ(tiles, size_t(geometry::kMaxImageSide)) << "a row each while nothing is known";
}

TEST(Rows, TheLastGoToSamplersThatHaveNothingElse) {
  auto s = by_rows();
  s.request_view(request(1, 1, 64, 8));
  s.begin_view({1});
  ASSERT_TRUE(s.lease("a", 0));
  ASSERT_TRUE(s.lease("b", 0));
  size_t of_a = 1;
  while (s.lease("a", 0)) ++of_a;
  EXPECT_EQ(of_a, 5u) << "two rows are left, one a sampler, but it is busy";
  EXPECT_FALSE(s.lease("b", 0)) << "so is this one";
  EXPECT_TRUE(s.lease("c", 0));
  EXPECT_TRUE(s.lease("d", 0));
}

TEST(Coarse, ComesFirstAndTheFineOneFollowsAtOnce) {
  for (const bool rows : {true, false}) {
    FrameSchedule s({.tile_size = 64, .frames_in_flight = 1});
    s.set_cut({rows, true});
    s.request_view(request(7, 3, 641, 402));
    ASSERT_TRUE(s.begin_view({9}));
    EXPECT_EQ(s.frames_in_flight(), 2u);
    EXPECT_EQ(s.views_in_flight(), 1u);
    std::vector<wire::Lease> leases;
    while (const auto l = lease_any(s)) leases.push_back(*l);
    const auto fine = std::find_if(leases.begin(), leases.end(), [](const auto& l) { return l.step == 1; });
    ASSERT_NE(fine, leases.begin());
    ASSERT_NE(fine, leases.end());
    const auto coarse_camera = geometry::subsample(request(7, 3, 641, 402).camera, 4);
    for (auto l = leases.begin(); l != leases.end(); ++l) {
      EXPECT_EQ(l->step, l < fine ? 4u : 1u);
      EXPECT_EQ(l->frame, l < fine ? leases[0].frame : leases[0].frame.next());
      EXPECT_EQ(l->camera, l < fine ? coarse_camera : request(7, 3, 641, 402).camera);
      EXPECT_EQ(l->request.value, 3u);
      EXPECT_EQ(l->viewer.value, 7u);
      EXPECT_EQ(l->epoch.value, 9u);
    }
    EXPECT_EQ(coarse_camera.width, 161);
    for (const auto& l : leases) {
      EXPECT_EQ(s.frames_completed(), 0u);
      s.tile_done(done(l), "a", 0.01);
    }
    EXPECT_EQ(s.frames_completed(), 1u) << "views are counted";
    EXPECT_EQ(s.frames_in_flight(), 0u);
  }
}

TEST(Coarse, IsDroppedOnceTheFineOneIsThere) {
  auto s = by_rows({.frames_in_flight = 1}, true);
  s.request_view(request(1, 1, 64, 4));
  s.begin_view({1});
  const auto stuck = s.lease("slow", 0);
  ASSERT_EQ(stuck->step, 4u);
  while (const auto l = s.lease("fast", 0)) s.tile_done(done(*l), "fast", 0.001);
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_EQ(s.frames_in_flight(), 0u);
  EXPECT_FALSE(s.tile_done(done(*stuck), "slow", 1));
}

// A schedule with a typical time of tiles, `typical_s`, and one frame of two rows begun.
FrameSchedule experienced(double typical_s, bool rows) {
  FrameSchedule s({.tile_size = 64, .frames_in_flight = 1, .lease_timeout_s = 100});
  s.set_cut({rows, false});
  s.request_view(request(1, 1, 64, 1));
  s.begin_view({1});
  const auto l = s.lease("a", 0);
  s.tile_done(done(*l), "a", typical_s);
  s.request_view(rows ? request(1, 2, 64, 2) : request(1, 2, 64, 128));
  s.begin_view({1});
  return s;
}

TEST(Backups, GoToAnotherSamplerOnceATileIsLongOut) {
  for (const bool rows : {true, false})
    for (const double typical : {0.001, 0.1}) {
      auto s = experienced(typical, rows);
      const double after = std::max(0.015, 3 * typical);
      EXPECT_DOUBLE_EQ(s.backup_after_s(), after);
      const auto a = s.lease("a", 10), b = s.lease("b", 10.001);
      ASSERT_TRUE(a && b);
      EXPECT_FALSE(s.lease("c", 10 + after - 0.0001)) << "not long enough";
      EXPECT_FALSE(s.backup_due(10 + after - 0.0001));
      EXPECT_TRUE(s.backup_due(10 + after + 0.0001));
      EXPECT_FALSE(s.lease("a", 10 + after + 0.0001)) << "its own";
      const auto backup = s.lease("c", 10 + after + 0.0001);
      ASSERT_TRUE(backup);
      EXPECT_EQ(backup->tile, a->tile);
      EXPECT_EQ(backup->rect, a->rect);
      EXPECT_NE(backup->lease, a->lease);
      EXPECT_EQ(s.backups(), 1u);
      EXPECT_FALSE(s.lease("d", 10 + after + 0.0002)) << "one backup at most, the other tile is not due";
      EXPECT_EQ(s.lease("a", 20)->tile, b->tile);
      // Either one completes the tile; the other's comes too late.
      EXPECT_TRUE(s.tile_done(done(*backup), "c", 20));
      EXPECT_FALSE(s.tile_done(done(*a), "a", 20.1));
      EXPECT_TRUE(s.tile_done(done(*b), "b", 20.1));
      EXPECT_EQ(s.frames_completed(), 2u);
      EXPECT_EQ(s.tiles_released(), 0u);
    }
}

TEST(Backups, AreNotForTilesThatWereExtended) {
  auto s = experienced(0.001, true);
  const auto a = s.lease("a", 10), b = s.lease("b", 10);
  s.extend(a->lease, "a", 10.5);
  EXPECT_EQ(s.lease("c", 10.51)->tile, b->tile);
  EXPECT_FALSE(s.lease("d", 10.51));
  EXPECT_EQ(s.lease("d", 10.6)->tile, a->tile);
}

TEST(Backups, OutliveTheSamplerTheyStandInFor) {
  auto s = experienced(0.001, true);
  const auto a = s.lease("a", 10), b = s.lease("b", 10);
  s.tile_done(done(*b), "b", 10.001);
  const auto backup = s.lease("c", 11);
  ASSERT_EQ(backup->tile, a->tile);
  EXPECT_EQ(s.release_sampler("a"), 1);
  EXPECT_FALSE(s.tile_open()) << "the backup is still at it";
  EXPECT_EQ(s.release_sampler("c"), 1);
  EXPECT_TRUE(s.tile_open());
  EXPECT_EQ(s.lease("d", 12)->tile, a->tile);
}

TEST(Backups, DoNotHideThatASamplerDied) {
  for (const bool alive : {true, false}) {
    auto s = experienced(0.001, true);
    ASSERT_TRUE(s.lease("a", 10));
    const auto b = s.lease("b", 10);
    s.tile_done(done(*b), "b", 10.001);
    s.tile_done(done(*s.lease("c", 11)), "c", 11.001);
    EXPECT_EQ(s.frames_in_flight(), 0u);
    EXPECT_EQ(s.leases_of("a"), 1u) << "nothing was heard of it";
    if (alive) s.heard_of("a");
    EXPECT_EQ(s.leases_of("a"), alive ? 0u : 1u);
    std::vector<std::string> lost;
    EXPECT_EQ(s.expire(200, [&](const std::string& name) { lost.push_back(name); }), alive ? 0 : 1);
    EXPECT_EQ(lost.size(), alive ? 0u : 1u);
    EXPECT_EQ(s.expire(300, kNobody), 0);
  }
  auto s = experienced(0.001, true);
  ASSERT_TRUE(s.lease("a", 10) && s.lease("b", 10));
  for (int i = 0; i < 2; ++i) s.tile_done(done(*s.lease("c", 11)), "c", 11.001);
  EXPECT_EQ(s.release_sampler("a"), 1);
  EXPECT_EQ(s.tiles_released(), 1u);
}

TEST(Backups, FinishAFrameBeforeTheNextIsFed) {
  FrameSchedule s({.frames_in_flight = 2, .lease_timeout_s = 100});
  s.set_cut({true, false});
  double now = 0;
  for (uint64_t i = 1; i <= 3; ++i) s.request_view(request(i, i, 64, 4));
  s.begin_view({1});
  const auto lost = s.lease("dead", now);
  while (s.tile_open()) s.tile_done(done(*s.lease("a", now)), "a", now + 0.001);
  s.begin_view({1});
  const auto l = s.lease("a", 1);
  EXPECT_EQ(l->frame, lost->frame) << "long out";
  EXPECT_EQ(l->tile, lost->tile);
  EXPECT_NE(s.lease("a", 1)->frame, lost->frame);
}

TEST(Turns, AreForThoseWhoWaitWhenTheyBegin) {
  auto s = by_rows({.frames_in_flight = 1});
  EXPECT_FALSE(s.turn_waiting());
  s.request_view(request(1, 1, 8, 1));
  s.request_view(request(3, 1, 8, 1));
  s.begin_turns();
  s.request_view(request(2, 1, 8, 1));
  s.request_view(request(3, 2, 8, 1));  // newer, keeps its turn
  std::vector<std::pair<uint64_t, uint64_t>> served;
  while (s.begin_view({1}, true)) {
    const auto l = s.lease("a", 0);
    served.push_back({l->viewer.value, l->request.value});
    s.tile_done(done(*l), "a", 0);
  }
  EXPECT_EQ(served, (std::vector<std::pair<uint64_t, uint64_t>>{{1, 1}, {3, 2}}));
  EXPECT_TRUE(s.view_waiting());
  EXPECT_FALSE(s.turn_waiting());
  s.begin_turns();
  s.forget_viewer({2});
  EXPECT_FALSE(s.turn_waiting());
}

TEST(DroppedFrames, LeaveTheirViewsWaiting) {
  auto s = by_rows({.frames_in_flight = 3}, true);
  for (const auto& r : {request(1, 1), request(2, 1), request(3, 1)}) s.request_view(r);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(s.begin_view({1}));
  s.request_view(request(2, 2));
  s.forget_viewer({3});
  s.drop_frames();
  EXPECT_EQ(s.frames_in_flight(), 0u);
  std::map<uint64_t, uint64_t> again;
  while (s.begin_view({2})) {
    const auto l = s.lease("a", 0);
    again[l->viewer.value] = l->request.value;
    while (const auto rest = lease_any(s)) s.tile_done(done(*rest), "a", 0);
    s.tile_done(done(*l), "a", 0);
  }
  EXPECT_EQ(again, (std::map<uint64_t, uint64_t>{{1, 1}, {2, 2}}));
}

}  // namespace
}  // namespace telesplat::master
