// Buffers of volume frames, and changes of the point model that wait for whole updates.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "client/viewer/points/update_batches.h"
#include "client/viewer/slices/cache.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

BufferedFrame frame_of(uint64_t number, uint64_t pixels = 10) {
  auto frame = std::make_shared<volume::VolumeFrame>();
  frame->frame = {number};
  return {frame, {{number}, double(number), {}}, pixels};
}

std::vector<uint64_t> left(SliceCache& cache) {
  std::vector<uint64_t> out;
  for (const FrameId f : cache.take_left()) out.push_back(f.value);
  return out;
}
using Frames = std::vector<uint64_t>;

TEST(SliceCache, AsynchronouslyTheNewestFrameIsOnDisplay) {
  SliceCache cache(false);
  EXPECT_EQ(cache.displayed().frame, nullptr);
  for (uint64_t i = 1; i <= 3; ++i) {
    cache.put(frame_of(i, 100 * i));
    EXPECT_EQ(cache.displayed().frame->frame.value, i);
    EXPECT_EQ(cache.figures().pixels, 100 * i);
  }
  cache.frame_done();
  EXPECT_EQ(left(cache), Frames{}) << "they are acknowledged when they come";
  EXPECT_EQ(cache.figures().frames, 3u);
  EXPECT_EQ(cache.figures().buffered, 0u);
}

TEST(SliceCache, InOrderFramesWaitForTheDisplay) {
  SliceCache cache(true);
  for (uint64_t i = 1; i <= 3; ++i) cache.put(frame_of(i));
  EXPECT_EQ(cache.displayed().frame, nullptr);
  EXPECT_EQ(cache.figures().buffered, 3u);
  EXPECT_EQ(cache.figures().pixels, 30u);
  cache.advance({1});
  EXPECT_EQ(cache.displayed().frame->frame.value, 1u);
  EXPECT_EQ(left(cache), Frames{});
  cache.frame_done();
  EXPECT_EQ(left(cache), Frames{1}) << "displayed: its buffer is free";
  cache.frame_done();
  EXPECT_EQ(left(cache), Frames{}) << "once";
  EXPECT_EQ(cache.displayed().frame->frame.value, 1u) << "it stays on display";
  cache.advance({9});
  EXPECT_EQ(cache.displayed().frame->frame.value, 1u) << "no such frame";
  cache.advance({3});
  EXPECT_EQ(cache.displayed().frame->frame.value, 3u);
  EXPECT_EQ(left(cache), Frames{2}) << "passed over";
  EXPECT_EQ(cache.figures().buffered, 0u);
}

TEST(SliceCache, AFrameThatWasReplacedBeforeItWasDoneHasLeftToo) {
  SliceCache cache(true);
  cache.put(frame_of(1));
  cache.put(frame_of(2));
  cache.advance({1});
  cache.advance({2});
  EXPECT_EQ(left(cache), Frames{1});
  cache.frame_done();
  EXPECT_EQ(left(cache), Frames{2});
}

TEST(SliceCache, FreesNoFrameThatIsDrawn) {
  SliceCache cache(false);
  cache.put(frame_of(1));
  const BufferedFrame drawn = cache.displayed();
  const std::weak_ptr<const volume::VolumeFrame> watched = drawn.frame;
  cache.put(frame_of(2));
  cache.free_dropped();
  EXPECT_EQ(watched.use_count(), 2) << "the drawer's, and the cache's: the worker will free it";
  const_cast<BufferedFrame&>(drawn).frame.reset();
  EXPECT_FALSE(watched.expired()) << "not freed by the drawer";
  cache.free_dropped();
  EXPECT_TRUE(watched.expired());
}

TEST(SliceCache, SharesFramesBetweenThreads) {
  SliceCache cache(false);
  std::atomic<bool> stop{false};
  std::thread display([&] {
    uint64_t last = 0;
    while (!stop) {
      const BufferedFrame f = cache.displayed();
      if (!f.frame) continue;
      EXPECT_GE(f.frame->frame.value, last);
      EXPECT_EQ(f.update.request.value, f.frame->frame.value);
      last = f.frame->frame.value;
    }
  });
  for (uint64_t i = 1; i <= 5000; ++i) {
    cache.put(frame_of(i));
    cache.free_dropped();
  }
  stop = true;
  display.join();
  cache.free_dropped();
  EXPECT_EQ(cache.displayed().frame.use_count(), 2);
}

class Batches : public testing::Test {
 protected:
  UpdateBatches::Change patch(uint64_t sequence, EpochId epoch) {
    return UpdateBatches::Insert{points::prepare_patch(config, {sequence}, camera, {0, 0, 24, 16}, image, {sequence}),
                                 epoch};
  }
  uint64_t drawn() {
    splat::DrawList list;
    cache.select(camera, {}, list);
    cache.end_frame();
    return list.applied.value;
  }
  EpochId epoch() {
    splat::DrawList list;
    cache.select(camera, {}, list);
    cache.end_frame();
    return list.epoch;
  }

  const points::ModelConfig config = test::scene_config(4);
  const geometry::Camera camera = test::scene_camera({0, 0.3, 0.8}, 24, 16);
  const image::DepthImage image = test::sample_scene(camera, {0, 0, 24, 16});
  ModelCache cache;
  UpdateBatches batches;
};

TEST_F(Batches, NothingOfAnUpdateIsShownBeforeTheDisplayTakesIt) {
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  batches.add(patch(1, {1}), cache);
  batches.add(patch(2, {1}), cache);
  batches.close({{7}, 0.5, {}});
  batches.add(patch(3, {1}), cache);
  EXPECT_EQ(drawn(), 0u);
  EXPECT_FALSE(batches.apply({8}, cache)) << "it is not complete";
  EXPECT_EQ(drawn(), 0u);
  const auto update = batches.apply({7}, cache);
  ASSERT_TRUE(update);
  EXPECT_EQ(update->requested_s, 0.5);
  EXPECT_EQ(drawn(), 2u) << "the next update's part still waits";
  batches.close({{8}, 0.6, {}});
  EXPECT_TRUE(batches.apply({8}, cache));
  EXPECT_EQ(drawn(), 3u);
}

TEST_F(Batches, UpdatesThatArePassedOverAreAppliedToo) {
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  for (uint64_t i = 1; i <= 3; ++i) {
    batches.add(patch(i, {1}), cache);
    batches.close({{i}, 0, {}});
  }
  EXPECT_TRUE(batches.apply({2}, cache));
  EXPECT_EQ(drawn(), 2u);
  EXPECT_FALSE(batches.apply({1}, cache)) << "it is over";
  EXPECT_TRUE(batches.apply({3}, cache));
  EXPECT_EQ(drawn(), 3u);
}

TEST_F(Batches, ANewEpochIsShownWithItsFirstWholeUpdate) {
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  batches.add(patch(1, {1}), cache);
  batches.close({{1}, 0, {}});
  batches.apply({1}, cache);
  batches.add(UpdateBatches::Begin{config, {2}, {2}}, cache);
  batches.add(patch(3, {2}), cache);
  EXPECT_EQ(epoch(), EpochId{1});
  batches.add(UpdateBatches::Forget{{4}, {}, {}}, cache);
  batches.close({{2}, 0, {}});
  EXPECT_TRUE(batches.apply({2}, cache));
  EXPECT_EQ(epoch(), EpochId{2});
  EXPECT_EQ(drawn(), 4u);
}

TEST_F(Batches, HeldChangesEndInTheSameModel) {
  ModelCache at_once;
  at_once.begin_replica(config, {1});
  batches.add(UpdateBatches::Begin{config, {1}, {}}, cache);
  for (uint64_t i = 1; i <= 4; ++i) {
    at_once.insert(std::get<UpdateBatches::Insert>(patch(i, {1})).patch, {1});
    batches.add(patch(i, {1}), cache);
  }
  batches.close({{1}, 0, {}});
  EXPECT_NE(cache.digest(), at_once.digest());
  batches.apply({1}, cache);
  EXPECT_EQ(cache.digest(), at_once.digest());
}

}  // namespace
}  // namespace telesplat::viewer
