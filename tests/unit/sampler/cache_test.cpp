// Chunks that a sampler keeps and those that it drops.
#include <gtest/gtest.h>

#include "common/geometry/trajectory.h"
#include "services/sampler/mesh/tiles.h"

namespace telesplat::sampler {
namespace {

// Ten boxes in a row along x, 100 bytes each, without triangles.
std::vector<geometry::ChunkInfo> row() {
  std::vector<geometry::ChunkInfo> out;
  for (int i = 0; i < 10; ++i) {
    const float x = float(i) - 4.5f;
    out.push_back({ChunkId{uint64_t(i)}, {{x - 0.4f, -0.4f, -0.4f}, {x + 0.4f, 0.4f, 0.4f}}, 0, 100});
  }
  return out;
}
std::vector<ChunkId> missing(ChunkCache& cache, const geometry::Camera& camera) {
  return cache.cut(camera, {0, 0, camera.width, camera.height}).missing;
}
// Looks along +x from just before chunk `first`.
geometry::Camera looking_right(int first) {
  return geometry::make_camera(geometry::look_at({first - 5.1, 0, 0}, {100, 0, 0}), 90, 64, 64);
}
std::vector<uint64_t> values(const std::vector<ChunkId>& ids) {
  std::vector<uint64_t> out;
  for (const ChunkId id : ids) out.push_back(id.value);
  return out;
}

TEST(ChunkCache, AsksForWhatTheViewNeedsNearestFirst) {
  ChunkCache cache(10000);
  EXPECT_FALSE(cache.known());
  cache.reset(row());
  EXPECT_TRUE(cache.known());
  EXPECT_EQ(values(missing(cache, looking_right(6))), (std::vector<uint64_t>{6, 7, 8, 9}));
  cache.mark_waiting({7});
  EXPECT_TRUE(cache.waiting({7}));
  EXPECT_EQ(values(missing(cache, looking_right(6))), (std::vector<uint64_t>{6, 7, 8, 9})) << "waiting is not holding";
  EXPECT_TRUE(cache.insert({7}, 100).empty());
  EXPECT_FALSE(cache.waiting({7}));
  EXPECT_EQ(values(missing(cache, looking_right(6))), (std::vector<uint64_t>{6, 8, 9}));
  EXPECT_EQ(cache.bytes(), 100u);
  EXPECT_TRUE(cache.insert({7}, 100).empty());
  EXPECT_EQ(cache.bytes(), 100u) << "the same chunk twice";
}

TEST(ChunkCache, LetsGoOfTheLeastRecentlyUsed) {
  ChunkCache cache(300);
  cache.reset(row());
  const auto view = [&](int first) {
    std::vector<uint64_t> removed;
    for (const ChunkId id : missing(cache, looking_right(first)))
      for (const ChunkId old : cache.insert(id, 100)) removed.push_back(old.value);
    return removed;
  };
  EXPECT_TRUE(view(8).empty());                                                                      // needs 8, 9
  EXPECT_TRUE(view(9).empty());                                                                      // needs 9 again
  missing(cache, geometry::make_camera(geometry::look_at({-4.5, 0, 5}, {-4.5, 0, 0}), 10, 64, 64));  // sees chunk 0
  EXPECT_TRUE(cache.insert({0}, 100).empty());
  missing(cache, geometry::make_camera(geometry::look_at({-3.5, 0, 5}, {-3.5, 0, 0}), 10, 64, 64));  // sees chunk 1
  EXPECT_EQ(values(cache.insert({1}, 100)), (std::vector<uint64_t>{8}));
  EXPECT_TRUE(cache.held({9}));
  EXPECT_LE(cache.bytes(), 300u);
}

TEST(ChunkCache, NeverLetsGoOfWhatTheViewNeeds) {
  ChunkCache cache(250);
  cache.reset(row());
  for (const ChunkId id : missing(cache, looking_right(4))) EXPECT_TRUE(cache.insert(id, 100).empty());
  EXPECT_EQ(cache.bytes(), 600u) << "over the budget, but all of it is in view";
  EXPECT_TRUE(missing(cache, looking_right(4)).empty());
  // The next view needs one chunk: the others are dropped.
  missing(cache, looking_right(9));
  EXPECT_EQ(cache.insert({9}, 100).size(), 4u);
  EXPECT_LE(cache.bytes(), 250u);
}

TEST(ChunkCache, PrefetchesWithinTheBudget) {
  auto chunks = row();
  for (auto& chunk : chunks) chunk.triangles = 10;
  const uint64_t decoded = 10 * ChunkCache::kBytesPerTriangle;
  ChunkCache cache(3 * ChunkCache::memory(decoded, 10) + 50);
  cache.reset(chunks);
  EXPECT_EQ(values(cache.prefetch(true)), (std::vector<uint64_t>{9, 8, 7})) << "coded bytes do not count";
  cache.insert({9}, decoded);
  EXPECT_EQ(values(cache.prefetch(true)), (std::vector<uint64_t>{8, 7}));
  EXPECT_TRUE(cache.prefetch(false).empty()) << "these are all leaves";
  cache.mark_waiting({5});
  cache.forget_waiting();
  EXPECT_EQ(cache.waiting_count(), 0u);
  cache.reset(row());
  EXPECT_EQ(cache.bytes(), 0u);
  EXPECT_FALSE(cache.held({9}));
}

TEST(ChunkCache, SurvivesAnIdThatIsNotInTheList) {
  ChunkCache cache(250);
  cache.reset(row());
  EXPECT_TRUE(cache.insert({1000}, 100).empty());
  EXPECT_EQ(cache.bytes_of({1000}), 0u);
  EXPECT_EQ(cache.bytes(), 100u);
}

// A list may claim that its chunks are empty: the cache counts the bytes that came.
TEST(ChunkCache, CountsWhatCame) {
  ChunkCache cache(300);
  auto claimed = row();
  for (auto& c : claimed) c.bytes = 0;
  cache.reset(claimed);
  missing(cache, looking_right(0));
  for (const uint64_t id : {0, 1, 2}) EXPECT_TRUE(cache.insert({id}, 100).empty());
  EXPECT_EQ(cache.bytes(), 300u);
  missing(cache, looking_right(9));
  EXPECT_EQ(cache.insert({9}, 100).size(), 1u) << "over the budget";
}

TEST(ChunkCache, WhatIsRefusedIsMissingAndInTheEndAHole) {
  ChunkCache cache(10000);
  cache.reset(row());
  cache.mark_waiting({9});
  EXPECT_EQ(cache.waiting_bytes(), 100u);
  EXPECT_FALSE(cache.refuse({9}));
  EXPECT_FALSE(cache.waiting({9}));
  EXPECT_EQ(values(missing(cache, looking_right(9))), std::vector<uint64_t>{9});
  EXPECT_FALSE(cache.refuse({9}));
  EXPECT_TRUE(cache.refuse({9})) << "the third time";
  EXPECT_TRUE(missing(cache, looking_right(9)).empty()) << "views do without it";
  EXPECT_EQ(cache.holes(), 1u);
  EXPECT_EQ(cache.bytes(), 0u);
}

TEST(ChunkCache, CountsTheHierarchyOverTriangles) {
  ChunkCache cache(1000);
  auto chunks = row();
  for (auto& chunk : chunks) chunk.triangles = 10;
  cache.reset(chunks);
  EXPECT_EQ(cache.prefetch(true).size(), 1u);
  cache.insert({0}, 100);
  EXPECT_EQ(cache.bytes(), ChunkCache::memory(100, 10));
}

}  // namespace
}  // namespace telesplat::sampler
