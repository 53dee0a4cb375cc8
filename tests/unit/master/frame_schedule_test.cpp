// View requests -> frames -> leases, without sockets and clocks.
#include <gtest/gtest.h>

#include <set>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

wire::ViewRequest request(uint64_t viewer, uint64_t id, int width = 256, int height = 128) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.camera.width = width;
  r.camera.height = height;
  return r;
}

const auto kNobody = [](const std::string&) {};

// Leases an open tile, else one of the next view, as the master does.
std::optional<wire::Lease> next(FrameSchedule& s, const std::string& sampler, double now_s) {
  do {
    if (auto lease = s.lease(sampler, now_s)) return lease;
  } while (s.begin_view({1}));
  return std::nullopt;
}

bool done(FrameSchedule& s, FrameId frame, uint64_t tile, double now_s, LeaseId lease = {}) {
  wire::TileDone m;
  m.frame = frame;
  m.tile = tile;
  m.lease = lease;
  return s.tile_done(m, "", now_s);
}

TEST(CutTiles, CoverTheFrameOnceFromTheCentre) {
  for (const auto& [w, h, size] :
       {std::tuple{1, 1, 16}, {256, 256, 256}, {257, 255, 64}, {1280, 800, 256}, {33, 900, 32}}) {
    std::vector<int> covered(size_t(w) * size_t(h), 0);
    double last = -1;
    for (const auto& r : cut_tiles(w, h, size)) {
      EXPECT_LE(r.width, size);
      EXPECT_LE(r.height, size);
      for (int y = r.y; y < r.y + r.height; ++y)
        for (int x = r.x; x < r.x + r.width; ++x) ++covered[size_t(y) * size_t(w) + size_t(x)];
      const double distance = std::hypot(r.x + r.width / 2.0 - w / 2.0, r.y + r.height / 2.0 - h / 2.0);
      EXPECT_GE(distance, last - 1e-9);
      last = distance;
    }
    EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), w * h) << w << "x" << h << " by " << size;
  }
}

TEST(FrameSchedule, LeasesEveryTileOnceThenCompletes) {
  FrameSchedule s({.tile_size = 64});
  EXPECT_FALSE(next(s, "a", 0));
  s.request_view(request(1, 5));
  EXPECT_TRUE(s.view_waiting());
  std::set<uint64_t> tiles, leases;
  FrameId frame;
  while (const auto l = next(s, "a", 0)) {
    EXPECT_EQ(l->blocks_in_frame, 8u);
    EXPECT_EQ(l->viewer.value, 1u);
    EXPECT_EQ(l->request.value, 5u);
    EXPECT_TRUE(tiles.insert(l->tile).second);
    EXPECT_TRUE(leases.insert(l->lease.value).second);
    frame = l->frame;
  }
  EXPECT_EQ(tiles.size(), 8u);
  EXPECT_EQ(s.leases_of("a"), 8u);
  EXPECT_EQ(s.leases_of("b"), 0u);
  for (uint64_t t = 0; t < 8; ++t) {
    EXPECT_EQ(s.frames_completed(), 0u);
    EXPECT_TRUE(done(s, frame, t, 0.1));
    EXPECT_FALSE(done(s, frame, t, 0.1)) << "a duplicate";
  }
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_EQ(s.frames_in_flight(), 0u);
  EXPECT_FALSE(done(s, frame, 0, 0.2)) << "of a frame that is complete";
  EXPECT_FALSE(done(s, {99}, 0, 0.2));
  EXPECT_FALSE(done(s, frame, 1000, 0.2));
}

// Views of a viewer that left take no sampler from other viewers.
TEST(FrameSchedule, FramesOfAViewerThatLeftEnd) {
  for (const Cut cut : {Cut{}, Cut{.rows = true}, Cut{.coarse = true}, Cut{.rows = true, .coarse = true}}) {
    FrameSchedule s({.tile_size = 64, .frames_in_flight = 2});
    s.set_cut(cut);
    s.request_view(request(1, 5, 1024, 1024));
    const auto out = next(s, "a", 0);
    ASSERT_TRUE(out);
    s.forget_viewer({1});
    EXPECT_FALSE(next(s, "b", 0.1)) << "of the view of one that left";
    s.request_view(request(2, 1));
    const auto others = next(s, "b", 0.1);
    ASSERT_TRUE(others);
    EXPECT_EQ(others->viewer.value, 2u);
    done(s, out->frame, out->tile, 0.2, out->lease);  // a tile that was leased may still come
    EXPECT_EQ(s.views_in_flight(), 1u) << "the other's";
    EXPECT_EQ(s.frames_completed(), 0u) << "it was not completed";
  }
}

TEST(FrameSchedule, AFrameOfOneThatLeftWithNothingOutEndsAtOnce) {
  FrameSchedule s({.tile_size = 64, .frames_in_flight = 1});
  s.request_view(request(1, 5));
  ASSERT_TRUE(s.begin_view({1}));
  s.forget_viewer({1});
  EXPECT_EQ(s.views_in_flight(), 0u);
  EXPECT_EQ(s.frames_in_flight(), 0u);
}

TEST(FrameSchedule, LeasesTellThePixelOfTheViewOrOfTheDisplay) {
  FrameSchedule s({.tile_size = 256});
  s.set_cut({.coarse = true});
  wire::ViewRequest of_camera = request(1, 1), of_display = request(2, 1);
  of_camera.camera.left = -1, of_camera.camera.right = 1;
  of_display.footprint = 0.001;
  s.request_view(of_camera);
  s.request_view(of_display);
  std::set<uint64_t> steps;
  while (const auto l = next(s, "a", 0)) {
    steps.insert(l->step);
    EXPECT_DOUBLE_EQ(l->footprint, l->viewer == of_camera.viewer ? 2.0 / 256 : 0.001) << "step " << l->step;
  }
  EXPECT_EQ(steps.size(), 2u) << "coarse and complete frames";
}

TEST(FrameSchedule, ALeaseThatRunsOutGoesToAnother) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  const auto first = next(s, "slow", 10);
  ASSERT_TRUE(first);
  EXPECT_FALSE(next(s, "fast", 11));
  std::vector<std::string> lost;
  const auto note = [&](const std::string& name) { lost.push_back(name); };
  EXPECT_EQ(s.expire(11.9, note), 0);
  s.extend(first->lease, "slow", 11.9);
  EXPECT_EQ(s.expire(13.8, note), 0) << "it was extended";
  EXPECT_EQ(s.expire(14, note), 1);
  EXPECT_EQ(lost, std::vector<std::string>{"slow"});
  EXPECT_EQ(s.tiles_released(), 1u);
  const auto second = next(s, "fast", 14);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->frame, first->frame);
  EXPECT_EQ(second->tile, first->tile);
  EXPECT_NE(second->lease, first->lease);
  s.extend(first->lease, "slow", 100);  // an earlier lease: unknown now
  EXPECT_EQ(s.expire(17, kNobody), 1);
  // The first tile that comes counts, from either sampler.
  EXPECT_TRUE(done(s, first->frame, first->tile, 17.5));
  EXPECT_FALSE(next(s, "fast", 18));
}

TEST(FrameSchedule, LeaseTimesFollowTileTimes) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 1, .lease_timeout_s = 2});
  EXPECT_EQ(s.lease_time_s(), 2);
  double now = 0;
  for (uint64_t i = 1; i <= 200; ++i) {
    s.request_view(request(1, i));
    const auto l = next(s, "a", now);
    ASSERT_TRUE(l);
    done(s, l->frame, l->tile, now += 0.02, l->lease);
  }
  EXPECT_NEAR(s.lease_time_s(), 25 * 0.02, 1e-6);
}

// A new sampler has to fetch and arrange its data first: that takes longer than a tile of an experienced one.
TEST(FrameSchedule, WhoHasFinishedNoTileHasTheLongestTime) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 1, .lease_timeout_s = 2});
  double now = 0;
  for (uint64_t i = 1; i <= 20; ++i) {
    s.request_view(request(1, i));
    const auto l = next(s, "a", now);
    ASSERT_TRUE(l);
    wire::TileDone m{.frame = l->frame, .tile = l->tile, .lease = l->lease};
    m.rays = 256 * 128;
    m.moments.sample_begin_s = now, m.moments.encode_end_s = now += 0.02;
    ASSERT_TRUE(s.tile_done(m, "a", now));
  }
  for (const auto& [sampler, expires_s] : {std::pair{"a", 25 * 0.02}, {"new", 2.0}}) {
    s.request_view(request(1, 100));
    ASSERT_TRUE(next(s, sampler, now));
    EXPECT_EQ(s.expire(now + expires_s - 0.1, kNobody), 0) << sampler;
    EXPECT_EQ(s.expire(now + expires_s + 0.1, kNobody), 1) << sampler;
    s.drop_frames();
    s.forget_viewer({1});
    now += 10;
  }
}

TEST(FrameSchedule, TheLatestRequestOfAViewerWins) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 1});
  for (uint64_t i = 1; i <= 5; ++i) s.request_view(request(1, i));
  EXPECT_EQ(next(s, "a", 0)->request.value, 5u);
  EXPECT_FALSE(s.view_waiting());
  s.request_view(request(1, 6));
  s.forget_viewer({1});
  EXPECT_FALSE(s.view_waiting());
}

TEST(FrameSchedule, ViewersTakeTurns) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 1});
  std::map<uint64_t, int> turns;
  for (uint64_t i = 1; i <= 30; ++i) {
    for (uint64_t v : {3, 1, 2}) s.request_view(request(v, i));
    const auto l = next(s, "a", 0);
    ASSERT_TRUE(l);
    ++turns[l->viewer.value];
    done(s, l->frame, l->tile, 0);
  }
  EXPECT_EQ(turns, (std::map<uint64_t, int>{{1, 10}, {2, 10}, {3, 10}}));
}

TEST(FrameSchedule, FramesInFlightAreBounded) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 2});
  std::vector<wire::Lease> leases;
  for (uint64_t i = 1; i <= 3; ++i) {
    s.request_view(request(1, i));
    if (const auto l = next(s, "a", 0)) leases.push_back(*l);
  }
  ASSERT_EQ(leases.size(), 2u);
  EXPECT_EQ(s.frames_in_flight(), 2u);
  EXPECT_TRUE(s.view_waiting());
  done(s, leases[0].frame, 0, 0);
  EXPECT_EQ(next(s, "a", 0)->request.value, 3u);
}

TEST(FrameSchedule, ASamplerThatLeavesGivesItsTilesBack) {
  FrameSchedule s({.tile_size = 64});
  s.request_view(request(1, 1));
  const auto a = next(s, "a", 0), b = next(s, "b", 0);
  EXPECT_EQ(s.release_sampler("a"), 1);
  EXPECT_EQ(s.release_sampler("a"), 0);
  EXPECT_EQ(next(s, "c", 0)->tile, a->tile);
  EXPECT_EQ(s.leases_of("b"), 1u);
  s.drop_frames();
  EXPECT_EQ(s.frames_in_flight(), 0u);
  EXPECT_FALSE(done(s, b->frame, b->tile, 0));
}

TEST(FrameSchedule, HugeFramesHaveBoundedTileCounts) {
  FrameSchedule s({.tile_size = 16});
  s.request_view(request(1, 1, geometry::kMaxImageSide, geometry::kMaxImageSide));
  EXPECT_LE(next(s, "a", 0)->blocks_in_frame, 1024u);
}

}  // namespace
}  // namespace telesplat::master
