// Cuts a volume into slabs, and decides which partition is in use.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "services/master/slabs/partition.h"

namespace telesplat::master {
namespace {

uint64_t weight_of(const std::vector<uint32_t>& weights, SlabRange r) {
  return std::accumulate(weights.begin() + r.begin, weights.begin() + r.end, uint64_t{0});
}

// Returns the least possible heaviest range, by dynamic programming over all cuts.
uint64_t best_heaviest(const std::vector<uint32_t>& weights, int parts) {
  const size_t n = weights.size();
  std::vector<uint64_t> best(n + 1, ~uint64_t{0});
  best[0] = 0;
  for (int p = 0; p < parts; ++p) {
    std::vector<uint64_t> next(n + 1, ~uint64_t{0});
    for (size_t end = 0; end <= n; ++end)
      for (size_t begin = 0; begin <= end; ++begin)
        if (best[begin] != ~uint64_t{0})
          next[end] = std::min(next[end], std::max(best[begin], weight_of(weights, {int(begin), int(end)})));
    best = next;
  }
  return best[n];
}

TEST(CutSlabs, AreEqualWhereSlicesAre) {
  const std::vector<uint32_t> even(12, 5);
  EXPECT_EQ(cut_slabs(even, 3), (std::vector<SlabRange>{{0, 4}, {4, 8}, {8, 12}}));
  EXPECT_EQ(cut_slabs(even, 1), (std::vector<SlabRange>{{0, 12}}));
  EXPECT_EQ(cut_slabs(even, 100).size(), 12u);
}

TEST(CutSlabs, NoMoreThanThereIsSomethingFor) {
  const std::vector<uint32_t> little{0, 0, 7, 0, 0, 3, 0};
  const auto slabs = cut_slabs(little, 5);
  ASSERT_EQ(slabs.size(), 2u);
  EXPECT_EQ(weight_of(little, slabs[0]), 7u);
  EXPECT_EQ(slabs[1].end, 7);
  EXPECT_EQ(cut_slabs(std::vector<uint32_t>(9, 0), 4), (std::vector<SlabRange>{{0, 9}}));
}

TEST(CutSlabs, HeaviestIsAsLightAsCanBe) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<uint32_t> weights(1 + random() % 24);
    for (auto& w : weights) w = random() % 3 ? random() % 1000 : 0;
    const int parts = 1 + int(random() % 8);
    const auto slabs = cut_slabs(weights, parts);
    ASSERT_FALSE(slabs.empty());
    ASSERT_LE(int(slabs.size()), parts);
    ASSERT_EQ(slabs.front().begin, 0);
    ASSERT_EQ(slabs.back().end, int(weights.size()));
    uint64_t heaviest = 0;
    for (size_t i = 0; i < slabs.size(); ++i) {
      ASSERT_LT(slabs[i].begin, slabs[i].end);
      if (i > 0) {
        ASSERT_EQ(slabs[i].begin, slabs[i - 1].end);
      }
      heaviest = std::max(heaviest, weight_of(weights, slabs[i]));
      if (slabs.size() > 1) {
        ASSERT_GT(weight_of(weights, slabs[i]), 0u);
      }
    }
    ASSERT_EQ(heaviest, best_heaviest(weights, parts));
    const int something = int(std::count_if(weights.begin(), weights.end(), [](uint32_t w) { return w > 0; }));
    ASSERT_EQ(int(slabs.size()), std::clamp(something, 1, parts)) << "everyone has something to do";
  }
}

class Partitions : public ::testing::Test {
 protected:
  Partitions() { p.set_slices(12); }
  // All samplers of the newest partition report that they are ready.
  void all_ready() {
    const auto newest = p.newest();
    for (const auto& s : newest->slabs) p.ready(s.sampler, newest->number, 1, 1);
  }
  SlabPartitions p;
};

TEST_F(Partitions, FirstOneIsInUseWhenReady) {
  EXPECT_FALSE(p.update(0));
  p.join("a");
  p.join("b");
  p.join("b");
  const auto made = p.update(0);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->number, 1u);
  ASSERT_EQ(made->slabs.size(), 2u);
  EXPECT_EQ(made->slabs[0].sampler, "a");
  EXPECT_EQ(made->slabs[1].range, (SlabRange{6, 12}));
  EXPECT_EQ(made->slab_of("b"), 1u);
  EXPECT_FALSE(made->slab_of("c"));
  EXPECT_FALSE(p.in_use());
  p.ready("a", 1, 1, 1);
  p.ready("b", 7, 1, 1);  // no such partition
  p.ready("c", 1, 1, 1);  // not in it
  EXPECT_FALSE(p.update(0.1));
  EXPECT_FALSE(p.in_use());
  p.ready("b", 1, 10, 20);
  EXPECT_FALSE(p.update(0.2));
  ASSERT_TRUE(p.in_use());
  EXPECT_EQ(p.in_use()->slabs[1].bytes, 20u);
}

TEST_F(Partitions, OldOneStaysInUseUntilTheNewOneIsReady) {
  p.join("a");
  p.update(0);
  all_ready();
  p.update(0);
  p.join("b");
  ASSERT_TRUE(p.update(1));
  EXPECT_EQ(p.in_use()->number, 1u);
  p.update(100);
  EXPECT_EQ(p.in_use()->number, 1u) << "however long that takes";
  // Another change meanwhile: only the newest counts.
  p.join("c");
  ASSERT_TRUE(p.update(101));
  p.ready("a", 2, 1, 1);
  p.ready("b", 2, 1, 1);
  p.update(101);
  EXPECT_EQ(p.in_use()->number, 1u);
  all_ready();
  p.update(102);
  EXPECT_EQ(p.in_use()->number, 3u);
  EXPECT_EQ(p.in_use()->slabs.size(), 3u);
}

TEST_F(Partitions, OneThatLostASamplerIsNotUsedAnyMore) {
  for (const char* s : {"a", "b", "c"}) p.join(s);
  p.update(0);
  all_ready();
  p.update(0);
  p.leave("b");
  EXPECT_FALSE(p.in_use());
  ASSERT_TRUE(p.update(1));
  EXPECT_EQ(p.newest()->slabs.size(), 2u);
  EXPECT_FALSE(p.in_use());
  // No picture is possible meanwhile: the wait ends after kReadyPatience_s.
  p.update(1 + kReadyPatience_s - 0.01);
  EXPECT_FALSE(p.in_use());
  p.update(1 + kReadyPatience_s);
  EXPECT_TRUE(p.in_use());
  // Again before one was ready: there is no new wait.
  p.leave("a");
  EXPECT_FALSE(p.in_use());
  p.update(1 + kReadyPatience_s);
  EXPECT_TRUE(p.in_use());
  p.leave("c");
  EXPECT_FALSE(p.update(9));
  EXPECT_FALSE(p.in_use());
}

TEST_F(Partitions, SamplersThatJoinMoveLittle) {
  for (const char* s : {"a", "b", "c", "d"}) p.join(s);
  const auto made = p.update(0);
  std::map<std::string, SlabRange> before;
  for (const auto& s : made->slabs) before[s.sampler] = s.range;
  p.join("e");
  int moved = 0;
  for (const auto& s : p.update(1)->slabs)
    for (int k = s.range.begin; k < s.range.end; ++k)
      moved += !before.contains(s.sampler) || k < before[s.sampler].begin || k >= before[s.sampler].end;
  EXPECT_LE(moved, 5) << "of 12 slices, about 2 of which are the new one's";
}

TEST_F(Partitions, MoreSamplersThanSlicesAreSpare) {
  std::vector<uint32_t> weights(12, 0);
  weights[3] = weights[8] = 10;
  EXPECT_TRUE(p.set_weights(weights));
  for (const char* s : {"a", "b", "c"}) p.join(s);
  const auto made = p.update(0);
  EXPECT_EQ(made->slabs.size(), 2u);
  ASSERT_EQ(made->spare.size(), 1u);
  EXPECT_FALSE(made->slab_of(made->spare[0]));
}

TEST_F(Partitions, UnevenWeightsCutAnewButNotAllTheTime) {
  for (const char* s : {"a", "b"}) p.join(s);
  p.update(0);
  std::vector<uint32_t> weights(12, 1);
  weights[0] = weights[1] = 30;
  EXPECT_TRUE(p.set_weights(weights));
  EXPECT_FALSE(p.update(kRecutAfter_s - 0.1)) << "too soon";
  const auto made = p.update(kRecutAfter_s);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->slabs[0].range, (SlabRange{0, 1}));
  weights[2] = 10;  // a little heavier
  EXPECT_TRUE(p.set_weights(weights));
  EXPECT_FALSE(p.update(100));
  // One heavy slice cannot be cut.
  weights.assign(12, 0);
  weights[0] = 1000;
  weights[11] = 1;
  EXPECT_TRUE(p.set_weights(weights));
  EXPECT_FALSE(p.update(200)) << "no other cut is better";
}

TEST_F(Partitions, AnotherVolumeBeginsAnew) {
  p.join("a");
  p.update(0);
  all_ready();
  p.update(0);
  p.set_slices(5);
  EXPECT_FALSE(p.in_use());
  ASSERT_TRUE(p.update(1));
  EXPECT_EQ(p.newest()->number, 2u);
  EXPECT_EQ(p.newest()->slabs[0].range, (SlabRange{0, 5}));
  all_ready();
  p.invalidate();
  EXPECT_TRUE(p.update(2)) << "samplers are told again where to fetch";
}

TEST_F(Partitions, WeightsOfAnotherVolumeAreRefused) {
  const std::vector<uint32_t> before(p.weights().begin(), p.weights().end());
  const Status s = p.set_weights(std::vector<uint32_t>(before.size() + 8, 3));
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().text.find(std::to_string(before.size() + 8)), std::string::npos) << s.error().text;
  EXPECT_EQ(std::vector<uint32_t>(p.weights().begin(), p.weights().end()), before);
}

}  // namespace
}  // namespace telesplat::master
