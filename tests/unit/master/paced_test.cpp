// Views and tiles at the pace of the viewers' links. Without sockets and clocks.
#include <gtest/gtest.h>

#include <set>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

constexpr InstanceId kFar{5}, kNear{6};

wire::ViewRequest request(InstanceId viewer, uint64_t id) {
  wire::ViewRequest r;
  r.viewer = viewer;
  r.request = {id};
  r.camera.width = 256;
  r.camera.height = 64;
  return r;
}

class Paced : public testing::Test {
 protected:
  void link(InstanceId viewer, uint64_t backlog) { schedule.on_link({viewer, 1e6, backlog, 0.02, 0}, now); }
  bool begins(InstanceId viewer, uint64_t id) {
    schedule.request_view(request(viewer, id));
    return schedule.begin_view({1}, false, now);
  }
  bool done(const wire::Lease& l, uint64_t bytes) {
    return schedule.tile_done({.frame = l.frame, .tile = l.tile, .lease = l.lease, .bytes_sent = bytes}, "a", now);
  }

  double now = 10;
  FrameSchedule schedule{{.tile_size = 64}};
};

TEST_F(Paced, AViewBeginsWhenTheLinkIsNearlyEmptyAndIsTheNewest) {
  link(kFar, 500'000);
  EXPECT_FALSE(begins(kFar, 1));
  EXPECT_FALSE(begins(kFar, 2)) << "it took the place of the one before";
  EXPECT_TRUE(begins(kNear, 1)) << "others go on";
  link(kFar, 10'000);
  ASSERT_TRUE(schedule.begin_view({1}, false, now));
  const auto near = schedule.lease("a", now);
  ASSERT_TRUE(near);
  EXPECT_EQ(near->viewer, kNear);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(schedule.lease("a", now));
  const auto far = schedule.lease("a", now);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->viewer, kFar);
  EXPECT_EQ(far->request.value, 2u);
}

TEST_F(Paced, TilesFollowAtThePaceOfTheLink) {
  link(kFar, 0);
  ASSERT_TRUE(begins(kFar, 1));
  const auto first = schedule.lease("a", now);
  ASSERT_TRUE(first);
  EXPECT_TRUE(done(*first, 80'000));  // 70 ms of the link are 70,000 bytes
  EXPECT_FALSE(schedule.lease("a", now));
  link(kFar, 80'000);
  EXPECT_FALSE(schedule.lease("a", now));
  link(kFar, 30'000);
  EXPECT_TRUE(schedule.lease("a", now));
}

TEST_F(Paced, ALinkThatTakesNothingDoesNotKeepOthersFromBeginning) {
  link(kFar, 0);
  ASSERT_TRUE(begins(kFar, 1));
  const auto first = schedule.lease("a", now);
  ASSERT_TRUE(first);
  EXPECT_TRUE(done(*first, 500'000));
  EXPECT_EQ(schedule.views_in_flight(), 1u);
  const auto lost = [](const std::string&) {};
  const auto wait = [&] {
    for (const double end = now + kHeld_s + 0.2; now < end; now += 0.05) schedule.expire(now, lost);
  };
  wait();
  EXPECT_EQ(schedule.views_in_flight(), 1u) << "nobody else waits: its samples are not made once more";
  schedule.request_view(request(kNear, 1));
  wait();
  EXPECT_EQ(schedule.views_in_flight(), 0u) << "it waits again";
  EXPECT_TRUE(schedule.view_waiting());
  EXPECT_TRUE(schedule.begin_view({1}, false, now)) << "the other's";
  EXPECT_FALSE(schedule.begin_view({1}, false, now));
  link(kFar, 0);
  EXPECT_TRUE(schedule.begin_view({1}, false, now));
}

// A view of four tiles; the first one filled the link.
class Overtaken : public Paced {
 protected:
  void begin(uint64_t buffers = 0) {
    link(kFar, 0);
    auto r = request(kFar, 1);
    r.buffers = buffers;
    r.moments.requested_s = 3;
    schedule.request_view(r);
    ASSERT_TRUE(schedule.begin_view({1}, false, now));
    const auto first = schedule.lease("a", now);
    out = schedule.lease("b", now);
    ASSERT_TRUE(first && out);
    EXPECT_TRUE(done(*first, 500'000));
    EXPECT_FALSE(schedule.lease("a", now));
  }
  void ask(uint64_t buffers = 0, double x = 1) {
    auto r = request(kFar, 2);
    r.buffers = buffers;
    r.camera.pose.position_room.x = x;
    schedule.request_view(r);
  }
  bool ends_after(double s) {
    schedule.end_overtaken(now + s);
    return schedule.views_in_flight() == 0;
  }

  std::optional<wire::Lease> out;  // the second tile
};

TEST_F(Overtaken, AViewThatWaitsForTheLinkEndsWhereANewerOneWaits) {
  begin();
  ask();
  schedule.end_overtaken(now + 0.2);
  EXPECT_TRUE(schedule.tile_open()) << "it is not old yet";
  EXPECT_FALSE(ends_after(0.3)) << "a tile of it is out";
  EXPECT_FALSE(schedule.tile_open());
  EXPECT_TRUE(schedule.take_ends(now).empty());
  now += 0.35;
  EXPECT_TRUE(done(*out, 1000)) << "what is out still comes";
  EXPECT_EQ(schedule.views_in_flight(), 0u);
  EXPECT_EQ(schedule.overtaken(), 1u);
  const auto ends = schedule.take_ends(now);
  ASSERT_EQ(ends.size(), 1u);
  EXPECT_EQ(ends[0].frame, out->frame);
  EXPECT_EQ(ends[0].viewer, kFar);
  EXPECT_EQ(ends[0].request.value, 1u);
  EXPECT_EQ(ends[0].tiles, 4u);
  EXPECT_EQ(ends[0].camera, out->camera);
  EXPECT_EQ(ends[0].moments.requested_s, 3);
  EXPECT_EQ(ends[0].moments.leased_s, now) << "so long the rest waited";
  EXPECT_EQ(schedule.frames_completed(), 0u) << "it is not complete";
  EXPECT_TRUE(schedule.take_ends(now).empty()) << "once";
  link(kFar, 0);
  ASSERT_TRUE(schedule.begin_view({1}, false, now));
  EXPECT_EQ(schedule.lease("a", now)->request.value, 2u);
}

TEST_F(Overtaken, ASamplerThatDiedDoesNotKeepIt) {
  begin();
  ask();
  EXPECT_FALSE(ends_after(0.3));
  schedule.release_sampler("b");
  EXPECT_EQ(schedule.views_in_flight(), 0u);
  EXPECT_EQ(schedule.take_ends(now).size(), 1u);
}

TEST_F(Overtaken, NobodyOvertakesWhereNoOtherViewWaits) {
  begin();
  EXPECT_TRUE(done(*out, 0));
  EXPECT_FALSE(ends_after(9));
  ask(0, 0);
  EXPECT_FALSE(ends_after(9)) << "the same view";
  ask();
  EXPECT_TRUE(ends_after(9));
}

TEST_F(Overtaken, ViewsInOrderAreAllWanted) {
  begin(2);
  EXPECT_TRUE(done(*out, 0));
  ask(2);
  EXPECT_FALSE(ends_after(9));
}

TEST_F(Overtaken, AViewThatDoesNotWaitForItsLinkIsSampledToItsEnd) {
  link(kFar, 0);
  ASSERT_TRUE(begins(kFar, 1));
  ASSERT_TRUE(schedule.lease("a", now));
  ask();
  EXPECT_FALSE(ends_after(9));
  EXPECT_TRUE(schedule.tile_open());
}

TEST_F(Overtaken, AViewWhoseLinkTakesMoreIsSampledToItsEnd) {
  begin();
  EXPECT_TRUE(done(*out, 0));
  ask();
  link(kFar, 0);
  EXPECT_FALSE(ends_after(9)) << "samplers are slow, not the link";
}

TEST_F(Overtaken, BandsOfRowsMakeNoWholeBlocksAndAreSampledToTheirEnd) {
  schedule.set_cut({.rows = true});
  begin();
  EXPECT_TRUE(done(*out, 0));
  ask();
  EXPECT_FALSE(ends_after(9));
}

TEST_F(Paced, WhatALinkWouldCarryForLongArrivesCoarseFirst) {
  schedule.set_cut({.coarse_if_slow = true});
  const auto steps = [&](uint64_t id, double rate_bytes_s) {
    schedule.on_link({kFar, rate_bytes_s, 0, 0.02, 0}, now);
    EXPECT_TRUE(begins(kFar, id));
    std::set<uint64_t> out;
    while (const auto l = schedule.lease("a", now)) {
      out.insert(l->step);
      done(*l, 4096);  // a byte a ray
      schedule.on_link({kFar, rate_bytes_s, 0, 0.02, 0}, now);
    }
    return out;
  };
  EXPECT_EQ(steps(1, 1e4), std::set<uint64_t>{1}) << "nobody knows what a ray takes";
  EXPECT_EQ(steps(2, 1e6), std::set<uint64_t>{1}) << "16 ms";
  EXPECT_EQ(steps(3, 1e4), (std::set<uint64_t>{1, 4})) << "1.6 s";
  schedule.set_cut({});
  EXPECT_EQ(steps(4, 1e4), std::set<uint64_t>{1}) << "it is not wished";
}

TEST_F(Paced, ANewPackerHasNothingUnderWay) {
  link(kFar, 500'000);
  EXPECT_FALSE(begins(kFar, 1));
  schedule.trust_packer();
  EXPECT_TRUE(schedule.begin_view({1}, false, now));
}

TEST_F(Paced, NoMoreThanTheWishedRate) {
  FrameSchedule wished{{.tile_size = 64, .max_rate_mbit = 8}};
  wished.on_link({kFar, 0, 0, 0, 0}, now);
  wished.request_view(request(kFar, 1));
  ASSERT_TRUE(wished.begin_view({1}, false, now));
  const auto first = wished.lease("a", now);
  ASSERT_TRUE(first);
  EXPECT_TRUE(wished.tile_done(
      {.frame = first->frame, .tile = first->tile, .lease = first->lease, .bytes_sent = 250'000}, "a", now));
  EXPECT_FALSE(wished.lease("a", now));
  EXPECT_FALSE(wished.lease("a", now + 0.15)) << "250 ms at that rate, 50 of which may wait";
  EXPECT_TRUE(wished.lease("a", now + 0.25));
}

}  // namespace
}  // namespace telesplat::master
