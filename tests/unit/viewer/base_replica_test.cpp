// A viewer's replica of the base: parts are asked for until all are there, and hidden triangles are told, in any
// order.
#include "client/viewer/points/base_replica.h"

#include <gtest/gtest.h>

#include <deque>
#include <set>

#include "common/wire/limits.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kPacker{7};
constexpr uint64_t kCoarse = 2, kParts = 8;

// A base of two coarse parts of a triangle and six fine ones of two.
class BaseReplicaTest : public testing::Test {
 protected:
  BaseReplicaTest() : replica([this](const wire::BaseRequest& m) { asked.push_back(m); }) {}

  void begin(uint64_t base = 1, uint64_t parts = kParts) {
    replica.take(wire::BaseBegin{kPacker, base, std::min(kCoarse, parts), parts}, now_s);
  }
  Status give(uint64_t part, uint64_t base = 1) {
    std::vector<test::Vertex> corners{{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}};
    std::vector<uint32_t> indices{0, 1, 2};
    if (part >= kCoarse) corners.push_back({{1, 1, 0}, {0, 0, 1}}), indices.insert(indices.end(), {1, 3, 2});
    const auto chunk = test::chunk_of(corners, indices);
    return replica.take(wire::BasePart{kPacker, base, part, 0.1, chunk.bytes}, now_s);
  }
  void hide(uint64_t number, const std::vector<uint32_t>& words, bool whole = false) {
    replica.take(wire::BaseHidden{kPacker, 1, number, whole, words}, now_s);
  }
  // The first 64 triangles of each part, as bits of those that are hidden.
  std::vector<uint64_t> hidden() const {
    std::vector<uint64_t> out;
    const auto mesh = replica.mesh();
    for (const auto& words : mesh->hidden) out.push_back(words.empty() ? 0 : words[0]);
    return out;
  }
  void give_all() {
    begin();
    for (uint64_t part = 0; part < kParts; ++part) ASSERT_TRUE(give(part).ok());
  }
  size_t triangles() const { return replica.mesh() ? replica.mesh()->triangles : 0; }

  double now_s = 10;
  std::deque<wire::BaseRequest> asked;
  BaseReplica replica;
};

TEST_F(BaseReplicaTest, AsksForPartsUntilAllAreThere) {
  replica.start(now_s);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].base, 0u);
  begin();
  std::set<uint64_t> wanted;
  for (size_t i = 1; i < asked.size(); ++i)
    for (uint64_t part = asked[i].part; part < asked[i].part + asked[i].parts; ++part)
      if (wanted.insert(part).second) ASSERT_TRUE(give(part).ok());
  EXPECT_TRUE(replica.complete());
  EXPECT_EQ(wanted.size(), kParts);
  const size_t before = asked.size();
  now_s += 100, replica.tick(now_s);
  EXPECT_EQ(asked.size(), before);
}

TEST_F(BaseReplicaTest, AsksAgainForAPartThatWasLost) {
  replica.start(now_s);
  begin();
  for (const uint64_t part : {0, 1, 3, 4, 5, 6, 7}) ASSERT_TRUE(give(part).ok());
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
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].base, 0u);
  EXPECT_EQ(triangles(), 12u) << "what has come stays on display";
}

TEST_F(BaseReplicaTest, TheCoarsePartsShowUntilAllFineOnesHaveCome) {
  begin();
  EXPECT_EQ(triangles(), 0u);
  ASSERT_TRUE(give(0).ok());
  EXPECT_EQ(triangles(), 1u);
  for (uint64_t part = 2; part < kParts; ++part) ASSERT_TRUE(give(part).ok());
  EXPECT_EQ(triangles(), 1u);
  ASSERT_TRUE(give(1).ok());
  EXPECT_EQ(triangles(), 12u);
}

TEST_F(BaseReplicaTest, APartThatComesTwiceCountsOnce) {
  begin();
  for (uint64_t n = 0; n < kParts; ++n) ASSERT_TRUE(give(0).ok());
  EXPECT_FALSE(replica.complete());
}

TEST_F(BaseReplicaTest, AnotherBaseReplacesTheFirst) {
  give_all();
  const uint64_t first = replica.changes();
  begin(2);
  EXPECT_NE(replica.changes(), first);
  EXPECT_FALSE(replica.complete());
  EXPECT_EQ(triangles(), 0u);
  ASSERT_TRUE(give(0, 2).ok());
  EXPECT_EQ(triangles(), 1u);
}

TEST_F(BaseReplicaTest, AnOlderBaseThatWasUnderWayDoesNotComeBack) {
  give_all();
  begin(2, 0);
  EXPECT_FALSE(replica.known());
  begin(1);
  ASSERT_TRUE(give(0).ok());
  EXPECT_FALSE(replica.known());
  EXPECT_EQ(triangles(), 0u);
}

// Words of parts 2 and 5, the first and the fourth fine one.
constexpr uint32_t kWord = wire::kBasePart / 64, kSecond = 2 * kWord, kFifth = 5 * kWord;

TEST_F(BaseReplicaTest, TellsWhichTrianglesAreHidden) {
  give_all();
  EXPECT_EQ(hidden(), (std::vector<uint64_t>{0, 0, 0, 0, 0, 0}));
  const uint64_t before = replica.changes();
  hide(1, {kSecond, 1, 0, kFifth, 2, 1});
  EXPECT_NE(replica.changes(), before);
  EXPECT_EQ(hidden(), (std::vector<uint64_t>{1, 0, 0, 0x100000002, 0, 0}));
  hide(2, {kSecond, 0, 0});
  EXPECT_EQ(hidden(), (std::vector<uint64_t>{0, 0, 0, 0x100000002, 0, 0}));
}

TEST_F(BaseReplicaTest, HiddenTrianglesMayBeToldBeforeTheyCome) {
  begin();
  hide(1, {kSecond, 1, 0});
  for (uint64_t part = 0; part < kParts; ++part) ASSERT_TRUE(give(part).ok());
  EXPECT_EQ(hidden()[0], 1u);
}

TEST_F(BaseReplicaTest, OlderWordsDoNotReplaceNewerOnes) {
  give_all();
  hide(5, {kSecond, 1, 0});
  hide(4, {kSecond, 0, 0}, true);
  EXPECT_EQ(hidden()[0], 1u);
}

TEST_F(BaseReplicaTest, AWholeMessageShowsWhatItDoesNotName) {
  give_all();
  hide(1, {kSecond, 1, 0, kFifth, 1, 0});
  hide(2, {kFifth, 1, 0}, true);
  EXPECT_EQ(hidden(), (std::vector<uint64_t>{0, 0, 0, 1, 0, 0}));
}

TEST_F(BaseReplicaTest, ALostMessageIsAskedForWithoutParts) {
  give_all();
  hide(1, {kSecond, 1, 0});
  asked.clear();
  hide(3, {kSecond, 3, 0});
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].parts, 0u);
}

TEST_F(BaseReplicaTest, WordsBeyondTheLastPartAreNotKept) {
  give_all();
  const uint64_t before = replica.changes();
  hide(1, {uint32_t(kParts) * kWord, 1, 0, 0xffffffff, 1, 0});
  EXPECT_EQ(replica.changes(), before);
}

TEST_F(BaseReplicaTest, DamagedPartsAreRefused) {
  begin();
  EXPECT_FALSE(give(kParts).ok()) << "beyond the last one";
  const std::vector<std::byte> damaged(60);
  EXPECT_FALSE(replica.take(wire::BasePart{kPacker, 1, 0, 0, damaged}, now_s).ok());
  const auto scalars =
      test::chunk_of({{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}}, {0, 1, 2}, true);
  EXPECT_FALSE(replica.take(wire::BasePart{kPacker, 1, 0, 0, scalars.bytes}, now_s).ok());
  std::vector<test::Vertex> many(4, {{0, 0, 0}, {0, 0, 1}});
  std::vector<uint32_t> indices;
  for (size_t i = 0; i <= splat::BasePart::kMostTriangles; ++i) indices.insert(indices.end(), {0, 1, 2});
  EXPECT_FALSE(replica.take(wire::BasePart{kPacker, 1, 0, 0, test::chunk_of(many, indices).bytes}, now_s).ok());
  many.resize(7, {{1, 0, 0}, {0, 0, 1}});
  EXPECT_FALSE(replica.take(wire::BasePart{kPacker, 1, 0, 0, test::chunk_of(many, {0, 1, 2}).bytes}, now_s).ok())
      << "more vertices than corners";
  EXPECT_FALSE(replica.complete());
}

}  // namespace
}  // namespace telesplat::viewer
