// Rows become blocks, in any order and among any other messages.
#include "services/packer/points/block_gatherer.h"

#include <gtest/gtest.h>

#include <numeric>

#include "services/packer/packing.h"
#include "services/packer/points/frame_book.h"
#include "tests/support/packer_scenes.h"

namespace telesplat::packer {
namespace {

using geometry::Rect;

const geometry::Camera kCamera = test::scene_camera({0.7, 0.4, 0}, 96, 64);

// Two blocks: rows 0..39 and rows 40..63.
SampledTile block_of(uint32_t number, FrameId frame = {1}) {
  SampledTile block;
  block.frame = frame, block.epoch = test::kEpoch, block.camera = kCamera;
  block.tile = number, block.tiles_in_frame = 2;
  block.rect = number == 0 ? Rect{0, 0, 96, 40} : Rect{0, 40, 96, 24};
  block.viewer = {77}, block.request = {5};
  return block;
}

std::vector<uint8_t> stream_of(const Rect& rect) { return codec::encode(test::sample_scene(kCamera, rect)); }

Rect rows(int first, int count) { return {0, first, 96, count}; }

uint64_t covered(const image::DepthImage& image) {
  return static_cast<uint64_t>(
      std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; }));
}

TEST(BlockGatherer, RowsInAnyOrderBecomeTheBlock) {
  BlockGatherer gatherer;
  std::vector<std::pair<uint32_t, Rect>> tiles;
  for (int y = 0; y < 40; ++y) tiles.emplace_back(0, rows(y, 1));
  for (int y = 40; y < 64; y += 3) tiles.emplace_back(1, rows(y, 3));
  std::mt19937_64 random(3);
  std::shuffle(tiles.begin(), tiles.end(), random);
  uint64_t samples[2] = {};
  int complete = 0;
  for (const auto& [number, rect] : tiles) {
    const auto got = gatherer.add(block_of(number), rect, stream_of(rect));
    ASSERT_TRUE(got.ok()) << got.error().text;
    ASSERT_TRUE(got->has_value());
    samples[number] += (*got)->samples;
    EXPECT_FALSE((*got)->is_block);
    if (!(*got)->block) continue;
    ++complete;
    const SampledTile& block = *(*got)->block;
    EXPECT_EQ(block.tile, number);
    EXPECT_EQ(block.rect, block_of(number).rect);
    EXPECT_EQ(block.tiles_in_frame, 2u);
    EXPECT_EQ(block.viewer.value, 77u);
    EXPECT_EQ(block.request.value, 5u);
    EXPECT_EQ(block.image, test::sample_scene(kCamera, block.rect));
    EXPECT_EQ(samples[number], covered(block.image)) << "what the tiles brought adds up to the block";
  }
  EXPECT_EQ(complete, 2);
  EXPECT_EQ(gatherer.open_blocks(), 0u);
}

TEST(BlockGatherer, RowsThatAreThereAreNotTakenAgain) {
  BlockGatherer gatherer;
  const auto first = gatherer.add(block_of(1), rows(44, 8), stream_of(rows(44, 8)));
  ASSERT_TRUE(first.ok() && first->has_value());
  for (const Rect& inside : {rows(44, 8), rows(50, 1)}) {
    const auto again = gatherer.add(block_of(1), inside, std::vector<uint8_t>{1, 2, 3});
    ASSERT_TRUE(again.ok()) << "a duplicate is not even decoded";
    EXPECT_FALSE(again->has_value());
  }
  EXPECT_EQ(gatherer.statistics().tiles_duplicate, 2u);
  // All rows of the block at once: only the new ones count.
  const auto rest = gatherer.add(block_of(1), block_of(1).rect, stream_of(block_of(1).rect));
  ASSERT_TRUE(rest.ok() && rest->has_value() && (*rest)->block);
  EXPECT_FALSE((*rest)->is_block);
  EXPECT_EQ((*first)->samples + (*rest)->samples, covered((*rest)->block->image));
  EXPECT_EQ((*rest)->block->image, test::sample_scene(kCamera, block_of(1).rect));
}

TEST(BlockGatherer, ATileThatIsItsBlockPassesThrough) {
  BlockGatherer gatherer;
  const auto got = gatherer.add(block_of(0), block_of(0).rect, stream_of(block_of(0).rect));
  ASSERT_TRUE(got.ok() && got->has_value() && (*got)->block);
  EXPECT_TRUE((*got)->is_block);
  EXPECT_EQ((*got)->samples, covered((*got)->block->image));
  EXPECT_EQ((*got)->block->image, test::sample_scene(kCamera, block_of(0).rect));
}

TEST(BlockGatherer, ContradictionsAreRefusedWithAReason) {
  BlockGatherer gatherer;
  const Rect good = rows(3, 2);
  ASSERT_TRUE(gatherer.add(block_of(0), good, stream_of(good)).ok());
  uint64_t refused = 0;
  const auto refuse = [&](const char* reason, auto&& change) {
    SampledTile block = block_of(0);
    Rect rect = rows(8, 1);
    std::vector<uint8_t> stream = stream_of(rect);
    change(block, rect, stream);
    const auto got = gatherer.add(block, rect, stream);
    ASSERT_FALSE(got.ok()) << reason;
    EXPECT_NE(got.error().text.find(reason), std::string::npos) << got.error().text;
    EXPECT_EQ(gatherer.statistics().tiles_refused, ++refused);
  };
  using Stream = std::vector<uint8_t>;
  refuse("not finite", [](SampledTile& b, Rect&, Stream&) { b.camera.top = NAN; });
  refuse("no block", [](SampledTile& b, Rect&, Stream&) { b.tile = b.tiles_in_frame; });
  refuse("no block", [](SampledTile& b, Rect&, Stream&) { b.tiles_in_frame = kMaxTilesInFrame + 1; });
  refuse("do not lie", [](SampledTile& b, Rect&, Stream&) { b.rect.y = -1; });
  refuse("do not lie", [](SampledTile& b, Rect&, Stream&) { b.rect.height = INT32_MAX; });
  refuse("do not lie", [](SampledTile& b, Rect&, Stream&) { b.rect.x = INT32_MAX; });
  refuse("whole rows", [](SampledTile&, Rect& r, Stream&) { r.width = 95; });
  refuse("whole rows", [](SampledTile&, Rect& r, Stream&) { r.y = 40; });
  refuse("whole rows", [](SampledTile&, Rect& r, Stream&) { r.y = INT32_MIN; });
  refuse("whole rows", [](SampledTile&, Rect& r, Stream&) { r.height = 0; });
  refuse("whole rows", [](SampledTile&, Rect& r, Stream&) { r.height = INT32_MAX; });
  refuse("earlier ones said", [](SampledTile& b, Rect&, Stream&) { b.tiles_in_frame = 3; });
  refuse("another camera", [](SampledTile& b, Rect&, Stream&) { b.camera.pose.position_room.x += 1e-9; });
  refuse("another camera", [](SampledTile& b, Rect&, Stream&) { b.step = 4; });
  refuse("for another", [](SampledTile& b, Rect&, Stream&) { b.rect.height = 30; });
  refuse("", [](SampledTile&, Rect&, Stream& s) { s.resize(s.size() / 2); });
  refuse("", [](SampledTile&, Rect& r, Stream&) { r.height = 2; });  // the stream has one row
  refuse("are gathered", [](SampledTile& b, Rect& r, Stream&) {
    b.frame = {2}, b.camera.width = 16384, b.camera.height = 16384;
    b.rect = {0, 0, 16384, 65};
    r = {0, 0, 16384, 1};
  });
  EXPECT_EQ(gatherer.open_blocks(), 1u);
  // The gatherer took nothing of it.
  const auto rest = gatherer.add(block_of(0), block_of(0).rect, stream_of(block_of(0).rect));
  ASSERT_TRUE(rest.ok() && rest->has_value() && (*rest)->block);
  EXPECT_EQ((*rest)->block->image, test::sample_scene(kCamera, block_of(0).rect));
}

TEST(BlockGatherer, UnfinishedBlocksDoNotPileUp) {
  BlockGatherer gatherer;
  const auto stream = stream_of(rows(0, 1));
  for (uint64_t frame = 1; frame <= kMaxGatheredFrames + 3; ++frame)
    ASSERT_TRUE(gatherer.add(block_of(0, {frame}), rows(0, 1), stream).ok());
  EXPECT_EQ(gatherer.open_blocks(), kMaxGatheredFrames);
  EXPECT_EQ(gatherer.statistics().blocks_dropped, 3u);
  gatherer.clear();
  EXPECT_EQ(gatherer.open_blocks(), 0u);
  // The largest blocks of one frame: beyond the memory limit for all, no more are taken.
  SampledTile block = block_of(0);
  block.camera.width = 16384, block.camera.height = 16384, block.tiles_in_frame = 100;
  const auto wide = codec::encode(image::DepthImage(16384, 1));
  size_t taken = 0;
  for (uint32_t n = 0; n < 100; ++n) {
    block.tile = n, block.rect = {0, static_cast<int>(64 * n), 16384, 64};
    taken += gatherer.add(block, {0, block.rect.y, 16384, 1}, wide).ok();
  }
  EXPECT_EQ(taken, kMaxGatheredPixels / kMaxBlockPixels);
  // A newer frame takes their place.
  EXPECT_TRUE(gatherer.add(block_of(0, {9}), rows(0, 1), stream).ok());
  EXPECT_EQ(gatherer.open_blocks(), 1u);
}

TEST(EpochHold, KeepsWhatFitsForAWhile) {
  EpochHold<int> hold({.items = 3, .bytes = 100, .patience_s = 1});
  for (const int i : {1, 2, 3, 4}) hold.add(i, 10, i);
  EXPECT_EQ(hold.size(), 3u) << "at most three";
  hold.add(5, 85, 5);
  EXPECT_EQ(hold.size(), 2u) << "at most 100 bytes: 4 and 5";
  EXPECT_EQ(hold.dropped(), 3u);
  hold.expire(5.5);
  EXPECT_EQ(hold.dropped(), 4u);
  auto waiting = hold.take();
  ASSERT_EQ(waiting.size(), 1u);
  EXPECT_EQ(waiting[0].item, 5);
  EXPECT_TRUE(hold.empty());
  hold.add(waiting[0].item, waiting[0].bytes, waiting[0].since_s);
  hold.expire(6.5);
  EXPECT_TRUE(hold.empty()) << "who waits on does not begin anew";
}

TEST(EpochHold, WhoHoldsMostMakesRoom) {
  EpochHold<int> hold({.items = 3, .bytes = 100, .patience_s = 1});
  hold.add(1, 10, 0, "anna");
  for (const int i : {11, 12, 13, 14}) hold.add(i, 10, 0, "eve");
  hold.add(2, 60, 0, "bert");
  hold.add(15, 50, 0, "eve");  // too many, and then too much
  const auto left = hold.take();
  ASSERT_EQ(left.size(), 2u);
  EXPECT_EQ(left[0].item, 1);
  EXPECT_EQ(left[1].item, 15) << "bert held more";
}

TEST(FrameBook, WhatIsOlderThanTheOldestThatIsRememberedIsNotTakenAgain) {
  FrameBook book;
  const auto add = [&](uint64_t frame, uint32_t tiles) {
    FramePart part;
    part.frame = {frame}, part.tile = 0, part.tiles_in_frame = tiles;
    book.add(part, {}, false);
  };
  add(1, 1);
  add(2, 2);
  for (uint64_t frame = 4; frame < 4 + kMaxFinishedFrames; ++frame) add(frame, 1);
  EXPECT_TRUE(book.has({1}, 0)) << "it is forgotten, and must not come again";
  EXPECT_FALSE(book.left({1}, 1));
  EXPECT_TRUE(book.has({2}, 0));
  EXPECT_FALSE(book.has({2}, 1)) << "it is still open";
  EXPECT_TRUE(book.has({4}, 0));
  EXPECT_FALSE(book.has({4 + kMaxFinishedFrames}, 0)) << "it is new";
  book.clear();
  EXPECT_FALSE(book.has({1}, 0)) << "another master counts anew";
}

}  // namespace
}  // namespace telesplat::packer
