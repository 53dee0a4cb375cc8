// A viewer's replica of the base: parts are asked for until all are there, and hidden surfels are not drawn, in any
// order of the messages.
#include "client/viewer/points/base_replica.h"

#include <gtest/gtest.h>

#include <deque>

#include "common/wire/limits.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kPacker{7};

// A base of leaves that hold `count` surfels each, along a line, in one part a leaf.
class BaseReplicaTest : public testing::Test {
 protected:
  BaseReplicaTest() : replica([this](const wire::BaseRequest& m) { asked.push_back(m); }) {}

  static codec::LeafSurfel surfel(uint32_t i) { return {uint8_t(i), uint8_t(i), uint8_t(i), 0x7f7f, i}; }
  static constexpr uint32_t kLeaves = 6, kCount = 100;

  Status give(uint64_t part, uint64_t base = 1, InstanceId packer = kPacker) {
    std::vector<codec::SurfelLeaf> leaves;
    if (part == 0) {
      for (uint32_t i = 0; i < kLeaves * kCount; i += wire::kBaseStride) {
        if (leaves.empty() || leaves.back().key != i / kCount) leaves.push_back({i / kCount, i, {}});
        leaves.back().surfels.push_back(surfel(i % kCount));
      }
    } else {
      leaves.push_back({uint32_t(part - 1), uint32_t(part - 1) * kCount, {}});
      for (uint32_t i = 0; i < kCount; ++i) leaves.back().surfels.push_back(surfel(i));
    }
    const auto stream = codec::encode_surfels(leaves);
    return replica.take(wire::BasePart{.packer = packer,
                                       .base = base,
                                       .part = part,
                                       .parts = 1 + kLeaves,
                                       .surfels = kLeaves * kCount,
                                       .depth = 4,
                                       .box_room = {glm::vec3(-1), glm::vec3(1)},
                                       .spacing_m = 0.01,
                                       .surfel_data = std::as_bytes(std::span(stream))},
                        now_s);
  }
  void hide(uint64_t number, const std::vector<uint32_t>& words, bool whole = false) {
    replica.take(wire::BaseHidden{kPacker, 1, number, whole, words}, now_s);
  }
  // Points of each leaf that changed since the last call.
  std::map<points::ClusterKey, uint32_t> changes() {
    std::map<points::ClusterKey, uint32_t> out;
    for (const auto& [key, mosaic] : replica.take_changes(1000)) out[key] = mosaic ? mosaic->count(0) : 0;
    return out;
  }
  void give_all() {
    for (uint64_t part = 0; part <= kLeaves; ++part) ASSERT_TRUE(give(part).ok());
  }

  double now_s = 10;
  std::deque<wire::BaseRequest> asked;
  BaseReplica replica;
};

TEST_F(BaseReplicaTest, AsksForPartsUntilAllAreThere) {
  replica.start(now_s);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].part, 0u);
  std::set<uint64_t> wanted;
  for (size_t i = 0; i < asked.size(); ++i)
    for (uint64_t part = asked[i].part; part < asked[i].part + asked[i].parts; ++part)
      if (wanted.insert(part).second) ASSERT_TRUE(give(part).ok());
  EXPECT_TRUE(replica.complete());
  EXPECT_EQ(wanted.size(), 1u + kLeaves);
  const size_t before = asked.size();
  now_s += 100, replica.tick(now_s);
  EXPECT_EQ(asked.size(), before);
}

TEST_F(BaseReplicaTest, AsksAgainForAPartThatWasLost) {
  replica.start(now_s);
  for (const uint64_t part : {0, 1, 3, 4, 5, 6}) ASSERT_TRUE(give(part).ok());
  now_s += 2 * BaseReplica::kPatience_s, replica.tick(now_s);
  EXPECT_EQ(asked.back().part, 2u);
  ASSERT_TRUE(give(2).ok());
  EXPECT_TRUE(replica.complete());
}

TEST_F(BaseReplicaTest, AsksForNothingWhereTheSessionHasNoBase) {
  replica.expect(false);
  replica.start(now_s);
  for (int second = 0; second < 10; ++second) replica.tick(now_s += BaseReplica::kPatience_s);
  EXPECT_TRUE(asked.empty());
  replica.expect(true);
  replica.tick(now_s);
  EXPECT_EQ(asked.size(), 1u) << "the scene has changed";
}

TEST_F(BaseReplicaTest, AsksAnotherPackerUntilItAnswers) {
  replica.start(now_s);
  give_all();
  replica.start(now_s);
  asked.clear();
  replica.tick(now_s += 2 * BaseReplica::kPatience_s);
  EXPECT_EQ(asked.size(), 1u);
}

TEST_F(BaseReplicaTest, PartZeroShowsAllLeavesCoarsely) {
  ASSERT_TRUE(give(0).ok());
  const auto leaves = changes();
  EXPECT_EQ(leaves.size(), kLeaves);
  for (const auto& [key, points] : leaves) EXPECT_NEAR(points, double(kCount) / wire::kBaseStride, 1);
  ASSERT_TRUE(give(3).ok());
  EXPECT_EQ(changes(), (std::map<points::ClusterKey, uint32_t>{{2, kCount}}));
}

TEST_F(BaseReplicaTest, PartZeroDoesNotReplaceFinerLeaves) {
  ASSERT_TRUE(give(0).ok());
  ASSERT_TRUE(give(1).ok());
  (void)changes();
  ASSERT_TRUE(give(0).ok());
  EXPECT_TRUE(changes().empty());
}

TEST_F(BaseReplicaTest, HiddenSurfelsAreNotDrawn) {
  give_all();
  (void)changes();
  hide(1, {0, 0xff, 0});  // surfels 0 to 7
  EXPECT_EQ(changes(), (std::map<points::ClusterKey, uint32_t>{{0, kCount - 8}}));
  hide(2, {1, 0xffffffff, 0xffffffff});  // 64 to 127: the end of leaf 0, the begin of leaf 1
  EXPECT_EQ(changes(), (std::map<points::ClusterKey, uint32_t>{{0, 56}, {1, 72}}));
  hide(3, {0, 0, 0});
  EXPECT_EQ(changes(), (std::map<points::ClusterKey, uint32_t>{{0, 64}}));
}

TEST_F(BaseReplicaTest, WhatIsHiddenMayComeBeforeTheSurfels) {
  hide(1, {0, 0xff, 0});
  give_all();
  EXPECT_EQ(changes()[0], kCount - 8);
}

TEST_F(BaseReplicaTest, OlderWordsDoNotReplaceNewerOnes) {
  give_all();
  hide(5, {0, 0xff, 0});
  hide(4, {0, 0, 0}, true);
  EXPECT_EQ(changes()[0], kCount - 8);
}

TEST_F(BaseReplicaTest, AWholeMessageShowsWhatItDoesNotName) {
  give_all();
  hide(1, {0, 0xff, 0, 3, 0xff, 0});
  hide(2, {3, 0xff, 0}, true);
  const auto leaves = changes();
  EXPECT_EQ(leaves.at(0), kCount);
  EXPECT_EQ(leaves.at(1), kCount - 8);
}

TEST_F(BaseReplicaTest, ALostMessageIsAskedForWithoutParts) {
  give_all();
  hide(1, {0, 1, 0});
  asked.clear();
  hide(3, {0, 3, 0});
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].parts, 0u);
}

TEST_F(BaseReplicaTest, AnotherBaseReplacesTheFirst) {
  give_all();
  const uint64_t first = replica.number();
  ASSERT_TRUE(give(0, 2).ok());
  EXPECT_NE(replica.number(), first);
  EXPECT_FALSE(replica.complete());
  EXPECT_EQ(changes().size(), kLeaves);
}

TEST_F(BaseReplicaTest, AnOlderBaseThatWasUnderWayDoesNotComeBack) {
  give_all();
  replica.take(wire::BaseHidden{kPacker, 2, 1, true, {}}, now_s);
  const uint64_t number = replica.number();
  ASSERT_TRUE(give(0).ok());
  hide(2, {0, 0xff, 0});
  EXPECT_EQ(replica.number(), number);
  EXPECT_FALSE(replica.known());
}

TEST_F(BaseReplicaTest, PartsThatContradictEarlierOnesAreRefused) {
  ASSERT_TRUE(give(0).ok());
  const auto stream = codec::encode_surfels(std::vector{codec::SurfelLeaf{1, 10'000, {surfel(1)}}});
  wire::BasePart part{.packer = kPacker,
                      .base = 1,
                      .part = 1,
                      .parts = 1 + kLeaves,
                      .surfels = kLeaves * kCount,
                      .depth = 4,
                      .box_room = {glm::vec3(-1), glm::vec3(1)},
                      .spacing_m = 0.01,
                      .surfel_data = std::as_bytes(std::span(stream))};
  EXPECT_FALSE(replica.take(part, now_s).ok());  // a surfel beyond the base's last
  for (const int axis : {0, 1, 2}) {
    const auto outside = codec::encode_surfels(std::vector{codec::SurfelLeaf{16u << 10 * axis, 0, {surfel(1)}}});
    part.surfel_data = std::as_bytes(std::span(outside));
    EXPECT_FALSE(replica.take(part, now_s).ok()) << "axis " << axis;
  }
  part.parts = 99;
  EXPECT_FALSE(replica.take(part, now_s).ok());
  part.parts = 1 + kLeaves, part.depth = 11;
  EXPECT_FALSE(replica.take(part, now_s).ok());
  const std::vector<uint8_t> damaged(40, 0xff);
  part.depth = 4, part.surfel_data = std::as_bytes(std::span(damaged));
  EXPECT_FALSE(replica.take(part, now_s).ok());
}

}  // namespace
}  // namespace telesplat::viewer
