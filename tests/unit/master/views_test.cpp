// Requests that wait: for asynchronous viewers only the newest, for the others all in order (T6.3-6.5).
#include <gtest/gtest.h>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

wire::ViewRequest request(uint64_t viewer, uint64_t id, uint64_t buffers = 0) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.buffers = buffers;
  r.camera.width = r.camera.height = 16;
  return r;
}

std::vector<uint64_t> ids(const std::vector<wire::ViewRequest>& requests) {
  std::vector<uint64_t> out;
  for (const auto& r : requests) out.push_back(r.request.value);
  return out;
}

TEST(ViewQueue, AsynchronousViewersWaitForTheirNewest) {
  ViewQueue q;
  EXPECT_TRUE(q.empty());
  EXPECT_EQ(q.next(), nullptr);
  q.add(request(1, 5));
  q.add(request(1, 6));
  EXPECT_EQ(q.waiting({1}), 1u);
  EXPECT_EQ(q.take({1}).request.value, 6u);
  EXPECT_TRUE(q.empty());
}

TEST(ViewQueue, BufferedOnesWaitInOrderUpToTheirBuffers) {
  ViewQueue q;
  for (uint64_t id = 1; id <= 5; ++id) q.add(request(1, id, 3));
  auto again = request(1, 2, 3);
  again.camera.width = 77;
  q.add(again);
  EXPECT_EQ(q.waiting({1}), 3u);
  EXPECT_EQ(q.take({1}).request.value, 1u);
  EXPECT_EQ(q.take({1}).camera.width, 77) << "asked again: the view wanted now, in its old place";
  EXPECT_EQ(q.take({1}).request.value, 3u);
  for (uint64_t id = 1; id <= 50; ++id) q.add(request(1, id, 1000));
  EXPECT_EQ(q.waiting({1}), wire::kMaxBuffers);
  q.add(request(1, 99));  // the viewer changed its coupling
  EXPECT_EQ(q.waiting({1}), 1u);
  EXPECT_EQ(q.take({1}).request.value, 99u);
}

TEST(ViewQueue, ViewersTakeTurns) {
  ViewQueue q;
  for (uint64_t id = 1; id <= 3; ++id)
    for (uint64_t viewer : {1, 2, 3}) q.add(request(viewer, viewer * 10 + id, 3));
  std::vector<wire::ViewRequest> taken;
  while (const auto* r = q.next()) taken.push_back(q.take(r->viewer));
  EXPECT_EQ(ids(taken), (std::vector<uint64_t>{11, 21, 31, 12, 22, 32, 13, 23, 33}));
}

TEST(ViewQueue, TurnsEndWhenARequestIsTaken) {
  ViewQueue q;
  q.add(request(1, 1, 2));
  q.add(request(1, 2, 2));
  EXPECT_EQ(q.next(true), nullptr);
  q.begin_turns();
  q.add(request(2, 1));
  EXPECT_TRUE(q.turn_waiting());
  EXPECT_EQ(q.next(true)->viewer.value, 1u);
  q.take({1});
  EXPECT_FALSE(q.turn_waiting()) << "what else it has waits for the next turn; the other viewer came later";
  EXPECT_EQ(q.next()->viewer.value, 2u);
}

TEST(ViewQueue, WhatIsPutBackComesFirst) {
  ViewQueue q;
  q.add(request(1, 3, 3));
  q.put_back(request(1, 2, 3));  // newest first
  q.put_back(request(1, 1, 3));
  for (uint64_t id = 1; id <= 3; ++id) EXPECT_EQ(q.take({1}).request.value, id);
  q.add(request(1, 5));
  q.put_back(request(1, 4));
  EXPECT_EQ(q.take({1}).request.value, 5u);
  EXPECT_TRUE(q.empty()) << "an older asynchronous view is not wanted any more";
  q.put_back(request(1, 4));
  EXPECT_EQ(q.take({1}).request.value, 4u) << "unless there is no newer one";
}

TEST(ViewQueue, TakesAllThatAreWanted) {
  ViewQueue q;
  for (uint64_t viewer = 1; viewer <= 6; ++viewer) q.add(request(viewer, viewer));
  q.take({1});
  const auto odd = [](const wire::ViewRequest& r) { return r.request.value % 2 == 1; };
  EXPECT_EQ(ids(q.take_all(odd, 1)), (std::vector<uint64_t>{3}));
  EXPECT_EQ(ids(q.take_all(odd, 10)), (std::vector<uint64_t>{5}));
  EXPECT_EQ(q.next()->viewer.value, 2u) << "the turn is still the next one's";
  q.forget({2});
  EXPECT_EQ(q.next()->viewer.value, 4u);
}

TEST(FrameSchedule, BufferedViewsAreBegunInOrderSeveralAtOnce) {
  FrameSchedule s({.tile_size = 64, .frames_in_flight = 1});
  for (uint64_t id = 1; id <= 4; ++id) s.request_view(request(1, id, 4));
  std::vector<wire::Lease> leases;
  const auto lease_all = [&] {
    do
      while (const auto l = s.lease("a", 0)) leases.push_back(*l);
    while (s.begin_view({1}));
  };
  lease_all();
  ASSERT_EQ(leases.size(), 3u) << "no more than three views are in flight for a viewer's buffers";
  s.request_view(request(1, 2, 4));  // asked again: it is in flight
  wire::TileDone done;
  done.frame = leases[1].frame;
  done.lease = leases[1].lease;
  EXPECT_TRUE(s.tile_done(done, "a", 0.1));
  lease_all();
  ASSERT_EQ(leases.size(), 4u);
  for (uint64_t id = 1; id <= 4; ++id) EXPECT_EQ(leases[id - 1].request.value, id);
  EXPECT_FALSE(s.view_waiting());
  // A new epoch: frames in flight are sampled anew, in order.
  s.drop_frames();
  leases.clear();
  lease_all();
  ASSERT_EQ(leases.size(), 3u);
  EXPECT_EQ(leases[0].request.value, 1u);
  EXPECT_EQ(leases[1].request.value, 3u);
  EXPECT_EQ(leases[2].request.value, 4u);
}

TEST(FrameSchedule, AsynchronousViewersHaveNoMoreInFlightThanBefore) {
  FrameSchedule s({.tile_size = 64, .frames_in_flight = 2});
  for (uint64_t viewer = 1; viewer <= 4; ++viewer) s.request_view(request(viewer, 1));
  int begun = 0;
  while (s.begin_view({1})) ++begun;
  EXPECT_EQ(begun, 2);
}

TEST(FrameSchedule, BufferedViewsOfTwoPassesAreAnsweredOnce) {
  FrameSchedule s({.tile_size = 64, .frames_in_flight = 1});
  s.set_cut({.rows = false, .coarse = true});
  s.request_view(request(1, 1, 1));
  ASSERT_TRUE(s.begin_view({1}));
  s.drop_frames();
  ASSERT_TRUE(s.begin_view({1}));
  EXPECT_FALSE(s.view_waiting()) << "its coarse frame and its fine one are the same view";
}

// A guest takes its share of the sampling, however much it asks for.
// One sampler of 2 million rays a second, on a clock of milliseconds. Each viewer always wants another view.
struct Session {
  struct Viewer {
    InstanceId id;
    std::string person;
    int side;
  };
  explicit Session(std::vector<Viewer> all) : viewers(std::move(all)) {}

  // Returns views a second of the first viewer.
  double rate(double for_s) {
    const double begin_s = now_s;
    uint64_t views = 0;
    for (; now_s < begin_s + for_s; now_s += 0.001) {
      for (const Viewer& v : viewers) ask(v);
      if (lease && now_s >= until_s) {
        wire::TileDone done;
        done.frame = lease->frame, done.tile = lease->tile, done.lease = lease->lease;
        const bool first = lease->viewer == viewers[0].id;
        const uint64_t before = schedule.frames_completed();
        schedule.tile_done(done, "sampler", now_s);
        views += first && schedule.frames_completed() > before;
        lease.reset();
      }
      if (!lease) take();
    }
    return double(views) / for_s;
  }
  void ask(const Viewer& v) {
    wire::ViewRequest r;
    r.viewer = v.id;
    r.request = {++requests};
    r.camera.width = r.camera.height = v.side;
    schedule.spending().asked(v.id, v.person, now_s);
    schedule.request_view(r);
  }
  void take() {
    do
      if (!lease) lease = schedule.lease("sampler", now_s);
    while ((!lease || schedule.begins_early(now_s)) && schedule.begin_view({1}, false, now_s));
    if (lease) until_s = now_s + double(lease->rect.width) * lease->rect.height / 2e6;
  }

  FrameSchedule schedule{{.tile_size = 256, .frames_in_flight = 2, .lease_timeout_s = 60}};
  std::vector<Viewer> viewers;
  std::optional<wire::Lease> lease;
  double now_s = 0, until_s = 0;
  uint64_t requests = 0;
};

TEST(Guests, OneWithLargeViewsHasItsShareAlone) {
  const Session::Viewer anna{{1}, "anna", 256};
  const double alone = Session({anna}).rate(20);
  EXPECT_GT(alone, 20);
  EXPECT_GE(Session({anna, {{2}, "ben", 4096}}).rate(40), 0.45 * alone);
  EXPECT_GE(Session({{{1}, "", 256}, {{2}, "ben", 4096}}).rate(40), 0.45 * alone) << "beside the owner";
}

TEST(Guests, OneWithManyViewersHasItsShareAlone) {
  const Session::Viewer anna{{1}, "anna", 256};
  const double alone = Session({anna}).rate(20);
  std::vector<Session::Viewer> all{anna};
  for (uint64_t i = 2; i <= 20; ++i) all.push_back({{i}, "ben", 256});
  EXPECT_GE(Session(all).rate(40), 0.45 * alone);
}

TEST(Guests, OneAloneHasEverything) {
  EXPECT_NEAR(Session({{{2}, "ben", 256}}).rate(20), Session({{{2}, "", 256}}).rate(20), 1);
}

}  // namespace
}  // namespace telesplat::master
