// Couplings that change while a viewer runs: credits, the gate, updates held back, and requests that get no update.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <thread>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/points/update_batches.h"
#include "client/viewer/slices/cache.h"
#include "common/core/clock.h"
#include "common/wire/limits.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

const CouplingState kAsync = coupling_state(CouplingMode::kAsync, 3), kSync = coupling_state(CouplingMode::kSync, 3),
                    kLoose = coupling_state(CouplingMode::kLoose, 3);

TEST(ToldCoupling, IsThatOfTheSettings) {
  using Order = wire::CouplingOrder;
  EXPECT_FALSE(coupling_told(Order::kOwn, 3));
  EXPECT_EQ(coupling_told(Order::kAsync, 3), kAsync);
  EXPECT_EQ(coupling_told(Order::kSync, 3), kSync);
  EXPECT_EQ(coupling_told(Order::kLoose, 3), kLoose);
  EXPECT_EQ(coupling_text(kSync), "sync");
  EXPECT_EQ(coupling_text(kLoose), "loose, 3 buffers");
  EXPECT_EQ(coupling_text({CouplingMode::kLoose, 1}), "loose, 1 buffer");
}

TEST(ChangedCoupling, WithFewerBuffersNothingIsAskedForUntilEnoughWasDisplayed) {
  Coupling c(3);
  for (uint64_t i = 1; i <= 3; ++i) c.asked({i}, 0);
  c.set_buffers(1);
  EXPECT_FALSE(c.may_ask());
  for (uint64_t i = 1; i <= 3; ++i) {
    c.completed({i}, 0);
    EXPECT_EQ(c.take(), RequestId{i}) << "none is lost";
    c.displayed();
    EXPECT_EQ(c.may_ask(), i == 3);
  }
  c.set_buffers(2);
  c.asked({4}, 0);
  EXPECT_TRUE(c.may_ask());
}

TEST(ChangedCoupling, AsynchronouslyNothingIsWaitedForAnyMore) {
  Coupling c(3);
  c.asked({1}, 0);
  c.asked({2}, 0);
  c.completed({1}, 0);
  ASSERT_EQ(c.take(), RequestId{1});
  c.completed({2}, 0);
  c.set_buffers(0);
  EXPECT_TRUE(c.may_ask());
  EXPECT_EQ(c.filled(), 0);
  EXPECT_FALSE(c.is_open({2}));
  c.set_buffers(1);
  EXPECT_FALSE(c.may_ask()) << "the frame that was begun is not displayed yet";
  c.displayed();
  EXPECT_TRUE(c.may_ask());
  EXPECT_TRUE(c.completed({2}, 1).empty()) << "what was asked for before counts no more";
}

// In any order of events: the credits are never exceeded, no update is displayed twice, and nothing hangs.
TEST(ChangedCoupling, NeverHangsAndNeverRepeats) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    std::mt19937 random(seed);
    CouplingGate gate(kAsync);
    uint64_t next = 1, last_displayed = 0;
    std::vector<uint64_t> at_master;
    double now_s = 0, last_s = 0;
    for (int step = 0; step < 2000; ++step) {
      now_s += 0.02;
      if (random() % 50 == 0) gate.change(coupling_state(CouplingMode(random() % 3), 1 + int(random() % 8)));
      const CouplingState state = gate.state();
      gate.with([&](Coupling& c) {
        while (c.waits() && c.may_ask()) {
          c.asked({next}, now_s);
          at_master.push_back(next++);
        }
        std::vector<RequestId> released;
        for (const RequestId r : c.overdue(now_s, released)) at_master.push_back(r.value);
        if (!at_master.empty() && random() % 2) {
          c.completed({at_master.front()}, now_s);
          at_master.erase(at_master.begin());
        }
      });
      const auto taken = gate.take(0);
      EXPECT_EQ(taken.coupling, state);
      if (!state.waits()) {
        EXPECT_FALSE(taken.request);
        last_s = now_s;
        continue;
      }
      if (taken.request) {
        ASSERT_GT(taken.request->value, last_displayed) << "seed " << seed;
        last_displayed = taken.request->value;
        gate.displayed();
        last_s = now_s;
      }
      ASSERT_LT(now_s - last_s, Coupling::kPatience_s) << "seed " << seed;
    }
  }
}

TEST(ChangedCoupling, ADisplayThatWaitsIsWokenAtOnce) {
  // The change comes before the display waits or, most often, afterwards.
  for (int i = 0; i < 100; ++i) {
    CouplingGate gate(kSync);
    const double begin_s = monotonic_s();
    std::thread worker([&] { gate.change(kAsync); });
    const auto taken = gate.take(60);
    worker.join();
    EXPECT_FALSE(taken.request);
    EXPECT_EQ(taken.coupling, kAsync);
    ASSERT_LT(monotonic_s() - begin_s, 30);
  }
}

TEST(ChangedRequests, ArePacedByCreditsOrByTheirRate) {
  ViewRequester requester{{.sampling_width = 640, .sampling_height = 400, .max_rate_hz = 1}, {5}};
  requester.on_pose(0, geometry::make_camera({}, 90, 1280, 800));
  const auto first = requester.next(0);
  ASSERT_TRUE(first);
  EXPECT_TRUE(requester.answer_open());
  EXPECT_FALSE(requester.next(0.1)) << "once a second";
  requester.set_buffers(2);
  const auto second = requester.next(0.1), third = requester.next(0.1);
  ASSERT_TRUE(second && third);
  EXPECT_EQ(second->buffers, 2u);
  requester.set_buffers(1);
  const auto again = requester.again(std::vector{second->request, third->request}, 0.2);
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].buffers, 2u) << "the master is to keep both";
  requester.set_buffers(0);
  EXPECT_FALSE(requester.next(0.3));
  const auto later = requester.next(2);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->buffers, 0u);
  // Requests made in order are answered all the same.
  EXPECT_TRUE(requester.on_part({.viewer = {5}, .request = second->request, .complete = true}, 2.05));
  EXPECT_TRUE(requester.on_part({.viewer = {5}, .request = third->request, .complete = true}, 2.1));
  EXPECT_TRUE(requester.on_part({.viewer = {5}, .request = later->request, .complete = true}, 2.2));
}

// Requests by credits may have come more often than the new rate allows; that makes no debt.
TEST(ChangedRequests, TheRateBeginsAnew) {
  ViewRequester requester{{.sampling_width = 640, .sampling_height = 400, .max_rate_hz = 10, .buffers = 2}, {5}};
  requester.on_pose(0, geometry::make_camera({}, 90, 1280, 800));
  for (int i = 0; i < 200; ++i) requester.next(0.01 * i);
  requester.set_buffers(0);
  EXPECT_FALSE(requester.next(2));
  EXPECT_TRUE(requester.next(2.1));
}

TEST(StallWatch, SaysWhenItIsLongAndWhenItIsOver) {
  StallWatch watch(10);
  EXPECT_FALSE(watch.waiting(100.5, 100, 99, kSync));
  EXPECT_FALSE(watch.take_news());
  EXPECT_EQ(watch.told_s(100.5), 0);
  EXPECT_FALSE(watch.waiting(101, 100, 99, kSync));
  const auto begins = watch.take_news();
  ASSERT_TRUE(begins);
  EXPECT_NE(begins->find("no view update for 1.0 s (sync)"), std::string::npos) << *begins;
  EXPECT_FALSE(watch.waiting(102, 100, 99, kSync));
  EXPECT_FALSE(watch.take_news()) << "once";
  EXPECT_EQ(watch.told_s(102), 2);
  watch.over(104.25);
  EXPECT_EQ(watch.take_news(), "the display goes on, after 4.2 s without a view update");
  EXPECT_EQ(watch.told_s(104.25), 0);
}

TEST(StallWatch, AShortWaitIsNotWorthAWord) {
  StallWatch watch;
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(watch.waiting(100 + i + 0.9, 100 + i, 0, kSync));
    watch.over(100 + i + 0.95);
    EXPECT_FALSE(watch.take_news());
  }
}

TEST(StallWatch, DrawsFromWhatIsThereUntilAnUpdateComes) {
  StallWatch watch(10);
  EXPECT_FALSE(watch.waiting(109.9, 100, 0, kLoose));
  EXPECT_TRUE(watch.waiting(110, 100, 0, kLoose));
  EXPECT_NE(watch.take_news()->find("frames are drawn from what is there"), std::string::npos);
  EXPECT_TRUE(watch.waiting(110.1, 110, 0, kLoose)) << "the next frame, too";
  EXPECT_EQ(watch.told_s(110.1), 110.1 - 100) << "the wait is the same";
  watch.over(111);
  EXPECT_FALSE(watch.waiting(111.2, 111, 0, kLoose));
  EXPECT_FALSE(watch.waiting(120.9, 111, 111.5, kLoose)) << "part of an answer came";
  EXPECT_TRUE(watch.waiting(121.5, 111, 111.5, kLoose));
}

class ReleasedBatches : public testing::Test {
 protected:
  UpdateBatches::Change patch(uint64_t sequence, EpochId epoch) {
    return UpdateBatches::Insert{points::prepare_patch(config, {sequence}, camera, {0, 0, 24, 16}, image, {sequence}),
                                 epoch};
  }
  splat::DrawList drawn() {
    splat::DrawList list;
    cache.select(camera, {}, list);
    cache.end_frame();
    return list;
  }
  std::optional<ShownUpdate> release() {
    return batches.release(
        cache, [&] { ++shown; }, [&](const UpdateBatches::Begin& b, bool held) { begun.emplace_back(b.epoch, held); });
  }

  const points::ModelConfig config = test::scene_config(4);
  const geometry::Camera camera = test::scene_camera({0, 0.3, 0.8}, 24, 16);
  const image::DepthImage image = test::sample_scene(camera, {0, 0, 24, 16});
  ModelCache cache;
  UpdateBatches batches;
  int shown = 0;
  std::vector<std::pair<EpochId, bool>> begun;
};

TEST_F(ReleasedBatches, EverythingIsAppliedAndTheNewestUpdateKnown) {
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  for (uint64_t i = 1; i <= 3; ++i) {
    batches.add(patch(i, {1}), cache);
    if (i < 3) batches.close({{i}, double(i), {}});
  }
  const auto newest = release();
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->request, RequestId{2});
  EXPECT_EQ(drawn().applied.value, 3u) << "the part of the third, too";
  EXPECT_EQ(shown, 1);
  EXPECT_FALSE(batches.apply({1}, cache)) << "a display that is late changes nothing";
  EXPECT_FALSE(release()) << "there is nothing left";
}

TEST_F(ReleasedBatches, AnEpochWithoutAWholeUpdateStaysBehindTheOneOnDisplay) {
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  batches.add(patch(1, {1}), cache);
  batches.close({{1}, 0, {}});
  batches.add(UpdateBatches::Begin{config, {2}, {2}}, cache);
  batches.add(patch(3, {2}), cache);
  ASSERT_TRUE(release());
  EXPECT_EQ(drawn().epoch, EpochId{1});
  ASSERT_EQ(begun.size(), 1u);
  EXPECT_EQ(begun[0], (std::pair{EpochId{2}, true}));
  cache.show_newest();
  EXPECT_EQ(drawn().epoch, EpochId{2});
}

TEST(ChangedSlices, TheNewestGoesOnDisplayAndAllHaveLeft) {
  const auto frame_of = [](uint64_t number) {
    auto frame = std::make_shared<volume::VolumeFrame>();
    frame->frame = {number};
    return BufferedFrame{frame, {{number}, double(number), {}}, 10};
  };
  SliceCache cache(true);
  for (uint64_t i = 1; i <= 3; ++i) cache.put(frame_of(i));
  cache.advance({1});
  cache.set_in_order(false);
  EXPECT_EQ(cache.displayed().frame->frame.value, 3u);
  EXPECT_EQ(cache.take_left(), (std::vector<FrameId>{{1}, {2}, {3}})) << "each is acknowledged once";
  cache.frame_done();
  EXPECT_TRUE(cache.take_left().empty());
  cache.put(frame_of(4));
  EXPECT_EQ(cache.displayed().frame->frame.value, 4u);
  cache.set_in_order(true);
  cache.put(frame_of(5));
  EXPECT_EQ(cache.displayed().frame->frame.value, 4u) << "it waits";
  cache.advance({5});
  cache.frame_done();
  EXPECT_EQ(cache.take_left(), std::vector<FrameId>{{5}}) << "the fourth was acknowledged when it came";
}

}  // namespace
}  // namespace telesplat::viewer
