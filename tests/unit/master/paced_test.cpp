// Views and tiles at the pace of the viewers' links. Without sockets and clocks.
#include <gtest/gtest.h>

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
  EXPECT_TRUE(done(*first, 80'000));  // 70 ms of the link are 70,000
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
