// A wall's displays hold back models and frames until all of them have these.
#include <gtest/gtest.h>

#include "client/viewer/points/update_batches.h"
#include "client/viewer/slices/cache.h"
#include "common/core/clock.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kPacker{7}, kOther{8};

class InStep : public testing::Test {
 protected:
  void begin(uint64_t sequence, uint64_t epoch, InstanceId packer = kPacker) {
    batches.add(UpdateBatches::Begin{config, {epoch}, {sequence}}, cache, packer);
  }
  void patch(uint64_t sequence, uint64_t epoch, InstanceId packer = kPacker) {
    batches.add(
        UpdateBatches::Insert{points::prepare_patch(config, {sequence}, camera, {0, 0, 24, 16}, image, {sequence}),
                              {epoch}},
        cache, packer);
  }
  void close(uint64_t request) { batches.close({{request}, double(request), {}}); }
  std::optional<ShownUpdate> show(uint64_t newest, uint64_t replica, InstanceId source = kPacker) {
    return batches.apply_until({source, newest, replica}, cache);
  }
  splat::DrawList drawn() {
    splat::DrawList list;
    cache.select(camera, {}, list);
    cache.end_frame();
    return list;
  }

  const points::ModelConfig config = test::scene_config(4);
  const geometry::Camera camera = test::scene_camera({0, 0.3, 0.8}, 24, 16);
  const image::DepthImage image = test::sample_scene(camera, {0, 0, 24, 16});
  ModelCache cache;
  UpdateBatches batches;
};

TEST_F(InStep, ChangesAreAppliedUpToANumber) {
  begin(0, 1);
  for (uint64_t i = 1; i <= 4; ++i) {
    patch(i, 1);
    close(i);
  }
  EXPECT_EQ(batches.newest(0), (wire::ShownState{kPacker, 4, 1}));
  const auto shown = show(2, 0);
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->request.value, 2u);
  EXPECT_EQ(drawn().applied.value, 2u);
  EXPECT_FALSE(show(2, 0)) << "nothing new";
  EXPECT_EQ(show(9, 0)->request.value, 4u) << "as far as there is something";
  EXPECT_EQ(drawn().applied.value, 4u);
}

TEST_F(InStep, ANewEpochIsShownWhenAllHaveAWholeViewOfIt) {
  begin(0, 1);
  patch(1, 1);
  close(1);
  show(1, 0);
  begin(2, 2);
  patch(3, 2);
  EXPECT_EQ(batches.newest(0).replica, 1u) << "no update is complete in it";
  close(2);
  EXPECT_EQ(batches.newest(0).replica, 3u);
  show(3, 1);
  EXPECT_EQ(drawn().epoch, EpochId{1}) << "another display lacks it";
  show(3, 3);
  EXPECT_EQ(drawn().epoch, EpochId{2});
}

TEST_F(InStep, AnEpochWithoutAWholeViewIsShownAfterAWhile) {
  begin(0, 1);
  patch(1, 1);
  close(1);
  begin(2, 2);
  patch(3, 2);
  const double now_s = monotonic_s();
  EXPECT_EQ(batches.newest(now_s).replica, 1u);
  EXPECT_EQ(batches.newest(now_s + UpdateBatches::kReplicaPatience_s + 1).replica, 3u);
}

// Otherwise an animation whose epochs follow each other fast would never be seen.
TEST_F(InStep, AnEpochThatIsToBeShownIsNotPassedOver) {
  begin(0, 1);
  patch(1, 1);
  close(1);
  show(1, 0);
  begin(2, 2);
  patch(3, 2);
  close(2);
  begin(4, 3);
  patch(5, 3);
  show(5, 3);
  EXPECT_EQ(drawn().epoch, EpochId{2});
}

TEST_F(InStep, AnotherPackersModelIsShownWhenTheOthersShowIt) {
  begin(0, 1);
  for (uint64_t i = 1; i <= 9; ++i) patch(i, 1);
  close(1);
  show(5, 0);
  begin(0, 1, kOther);
  patch(1, 1, kOther);
  close(2);
  EXPECT_EQ(batches.newest(0), (wire::ShownState{kOther, 1, 1}));
  show(9, 1);
  EXPECT_EQ(drawn().applied.value, 9u) << "the others are with the old one";
  show(1, 1, kOther);
  EXPECT_EQ(drawn().applied.value, 1u);
  patch(2, 1, kOther);
  show(9, 0);
  EXPECT_EQ(drawn().applied.value, 1u) << "the old one is gone";
}

BufferedFrame frame_of(uint64_t number, InstanceId source = kPacker) {
  auto frame = std::make_shared<volume::VolumeFrame>();
  frame->frame = {number};
  return {frame, {{number}, double(number), {}}, 10, source};
}

TEST(SlicesInStep, FramesWaitUntilTheOthersHaveThem) {
  SliceCache cache(false, true);
  for (const uint64_t n : {1, 2, 4}) cache.put(frame_of(n));
  EXPECT_EQ(cache.displayed().frame, nullptr);
  EXPECT_EQ(cache.newest().frame.value, 4u);
  cache.show_until(kPacker, {3});
  EXPECT_EQ(cache.displayed().frame->frame.value, 2u) << "the nearest that is here";
  cache.show_until(kPacker, {3});
  EXPECT_EQ(cache.displayed().frame->frame.value, 2u);
  cache.show_until(kPacker, {4});
  EXPECT_EQ(cache.displayed().frame->frame.value, 4u);
  cache.frame_done();
  EXPECT_TRUE(cache.take_left().empty()) << "they were acknowledged when they came";
}

TEST(SlicesInStep, TellsWhichFramesAreHere) {
  SliceCache cache(false, true);
  EXPECT_EQ(cache.newest().held, 0u);
  for (const uint64_t n : {1, 2, 4}) cache.put(frame_of(n));
  EXPECT_EQ(cache.newest().held, 0b1101u) << "4, 2, 1";
  cache.show_until(kPacker, {2});
  EXPECT_EQ(cache.newest().held, 0b101u) << "4 waits, 2 is on display";
  cache.put(frame_of(1, kOther));
  EXPECT_EQ(cache.newest().source, kOther);
  EXPECT_EQ(cache.newest().held, 1u);
}

TEST(SlicesInStep, AnotherMastersFramesFollowThoseOfTheFirst) {
  SliceCache cache(false, true);
  cache.put(frame_of(70));
  cache.put(frame_of(1, kOther));
  cache.show_until(kOther, {1});
  EXPECT_EQ(cache.displayed().frame->frame.value, 1u);
}

TEST(SlicesInStep, FramesThatNobodyElseHasDoNotPileUp) {
  SliceCache cache(false, true);
  for (uint64_t n = 1; n <= 100; ++n) cache.put(frame_of(n));
  EXPECT_LE(cache.figures().buffered, SliceCache::kMostInStep);
  EXPECT_EQ(cache.displayed().frame->frame.value, 100 - SliceCache::kMostInStep);
}

}  // namespace
}  // namespace telesplat::viewer
