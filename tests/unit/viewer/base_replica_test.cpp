// A viewer's replica of the base: nodes near the head are asked for, the rest is dropped, and hidden triangles are
// told, in any order.
#include "client/viewer/points/base_replica.h"

#include <gtest/gtest.h>

#include <deque>
#include <set>

#include "common/wire/limits.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kPacker{7};
constexpr uint64_t kPart = wire::kBasePart;
// Nodes of the tree below, and the first parts of some.
constexpr uint32_t kLeft = 4, kRight = 5, kRoot = 6;
constexpr uint64_t kLeftPart = 8, kRootPart = 10, kParts = 11;
// Room for one half of the leaves.
constexpr uint64_t kMost = 5 * kPart;

// Four leaves of two parts in a row along x, two nodes of one part above them, and a root of one part.
std::vector<geometry::ChunkInfo> tree() {
  std::vector<geometry::ChunkInfo> out;
  const auto node = [&](float x0, float x1, uint64_t parts, float spacing_m, uint32_t first, uint32_t children) {
    out.push_back({ChunkId{out.size()}, {{x0, 0, 0}, {x1, 1, 1}}, parts * kPart, 0, spacing_m, first, children});
  };
  for (int i = 0; i < 4; ++i) node(float(i), float(i + 1), 2, 0, 0, 0);
  node(0, 2, 1, 0.1f, 0, 2), node(2, 4, 1, 0.1f, 2, 2), node(0, 4, 1, 0.4f, 4, 2);
  return out;
}

class BaseReplicaTest : public testing::Test {
 protected:
  BaseReplicaTest() : replica([this](const wire::BaseRequest& m) { asked.push_back(m); }) { replica.expect(kMost); }

  void begin(uint64_t base = 1) { replica.take(wire::BaseTree{kPacker, base, tree()}, now_s); }
  Status give(uint64_t part, uint64_t base = 1) {
    const float x0 = part < kLeftPart ? float(part / 2) : part == kLeftPart + 1 ? 2 : 0;
    const float x1 = x0 + (part < kLeftPart ? 1 : part < kRootPart ? 2 : 4);
    return replica.take(wire::BasePart{kPacker, base, part, chunk(x0, x1, kPart).bytes}, now_s);
  }
  // Repeats one triangle.
  static geometry::ChunkBytes chunk(float x0, float x1, uint64_t triangles) {
    std::vector<uint32_t> indices;
    for (uint64_t i = 0; i < triangles; ++i) indices.insert(indices.end(), {0, 1, 2});
    return test::chunk_of({{{x0, 0, 0}, {0, 0, 1}}, {{x1, 0, 0}, {0, 0, 1}}, {{x0, 1, 0}, {0, 0, 1}}}, indices);
  }
  void hide(uint64_t number, const std::vector<uint32_t>& words, bool whole = false) {
    replica.take(wire::BaseHidden{kPacker, 1, number, whole, words}, now_s);
  }
  // Looks from a place along x, and gives what is asked for until nothing is. Returns these parts.
  std::set<uint64_t> look(double x, double fine = 0.001) {
    std::set<uint64_t> out;
    for (size_t before = ~size_t{0}; before != out.size();) {
      before = out.size();
      replica.tick(splat::Viewpoint{{x, 0.5, 0.5}, fine}, now_s += 2 * BaseReplica::kPlans_s);
      for (; !asked.empty(); asked.pop_front())
        for (uint64_t part = asked.front().part; part < asked.front().part + asked.front().parts; ++part)
          if (out.insert(part).second) EXPECT_TRUE(give(part).ok());
    }
    return out;
  }
  // Nodes that mesh() has, and the first word of what is hidden of the first part of the last one.
  size_t shown() const { return replica.mesh() ? replica.mesh()->nodes.size() : 0; }
  uint64_t hidden() const {
    const auto bits = replica.mesh()->nodes.back().parts.front().hidden;
    return bits ? bits->front() : 0;
  }

  double now_s = 10;
  std::deque<wire::BaseRequest> asked;
  BaseReplica replica;
};

TEST_F(BaseReplicaTest, AsksForTheTreeAndThenForItsRoot) {
  replica.start(now_s);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].base, 0u);
  begin();
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[1].part, kRootPart);
  EXPECT_EQ(asked[1].base, 1u);
}

TEST_F(BaseReplicaTest, AsksForFinerNodesNearTheHeadAndDropsOthers) {
  replica.start(now_s);
  begin();
  EXPECT_EQ(look(-0.5), (std::set<uint64_t>{0, 1, 2, 3, 8, 9, kRootPart}));
  EXPECT_EQ(shown(), 5u);
  EXPECT_TRUE(replica.take_dropped().empty());
  EXPECT_EQ(look(4.5), (std::set<uint64_t>{4, 5, 6, 7}));
  EXPECT_EQ(shown(), 5u);
  EXPECT_EQ(replica.take_dropped(), (std::vector<uint32_t>{0}));
  EXPECT_EQ(look(-0.5), (std::set<uint64_t>{0, 1})) << "node 1 was held";
}

TEST_F(BaseReplicaTest, DoesNotAskForNodesBelowOneThatIsFineEnough) {
  replica.start(now_s);
  begin();
  EXPECT_EQ(look(-100, 0.01), (std::set<uint64_t>{kRootPart}));
}

TEST_F(BaseReplicaTest, ChildrenShowOnceAllOfThemAreThere) {
  begin();
  EXPECT_EQ(shown(), 0u);
  ASSERT_TRUE(give(kRootPart).ok());
  EXPECT_EQ(shown(), 1u);
  ASSERT_TRUE(give(kLeftPart).ok());
  EXPECT_EQ(shown(), 1u);
  ASSERT_TRUE(give(kLeftPart + 1).ok());
  EXPECT_EQ(shown(), 3u);
  for (const uint64_t part : {4, 5, 6}) ASSERT_TRUE(give(part).ok());
  EXPECT_EQ(shown(), 3u);
  ASSERT_TRUE(give(7).ok());
  EXPECT_EQ(shown(), 5u);
  const auto mesh = replica.mesh();
  EXPECT_EQ(mesh->roots, 1u);
  EXPECT_EQ(mesh->nodes[1].children, 0u) << "the left node";
  EXPECT_EQ(mesh->nodes[2].children, 2u);
  EXPECT_EQ(mesh->nodes[3].parts.size(), 2u);
}

TEST_F(BaseReplicaTest, ADroppedNodeShowsItsParent) {
  begin();
  for (uint64_t part = 0; part < kParts; ++part) ASSERT_TRUE(give(part).ok());
  EXPECT_EQ(shown(), 7u);
  replica.drop(2);
  EXPECT_EQ(shown(), 5u);
  replica.drop(kRight);
  EXPECT_EQ(shown(), 1u);
}

TEST_F(BaseReplicaTest, AsksAgainForAPartThatWasLost) {
  replica.start(now_s);
  begin();
  asked.clear();
  replica.tick({}, now_s += 0.5 * BaseReplica::kPatience_s);
  EXPECT_TRUE(asked.empty());
  replica.tick({}, now_s += BaseReplica::kPatience_s);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].part, kRootPart);
}

TEST_F(BaseReplicaTest, AsksForNothingWhereTheSessionHasNoBase) {
  replica.expect(0);
  replica.start(now_s);
  for (int second = 0; second < 10; ++second) replica.tick({}, now_s += BaseReplica::kPatience_s);
  EXPECT_TRUE(asked.empty());
  replica.expect(kMost);
  replica.tick({}, now_s += BaseReplica::kPatience_s);
  EXPECT_EQ(asked.size(), 1u) << "the scene has changed";
}

TEST_F(BaseReplicaTest, AsksAnotherPackerUntilItAnswers) {
  replica.start(now_s);
  begin();
  look(-0.5);
  replica.start(now_s);
  asked.clear();
  replica.tick({}, now_s += 2 * BaseReplica::kPatience_s);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].base, 0u);
  EXPECT_EQ(shown(), 5u) << "what has come stays on display";
}

TEST_F(BaseReplicaTest, ANewConnectionToThePackerLosesNothing) {
  replica.start(now_s);
  begin();
  look(-0.5);
  replica.start(now_s);
  begin();
  asked.clear();
  EXPECT_EQ(shown(), 5u);
  EXPECT_TRUE(look(-0.5).empty());
}

TEST_F(BaseReplicaTest, AnotherBaseReplacesTheFirst) {
  replica.start(now_s);
  begin();
  look(-0.5);
  asked.clear();
  replica.take(wire::BaseBegin{kPacker, 2, 7}, now_s);
  EXPECT_EQ(shown(), 0u);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].base, 0u);
  begin(2);
  ASSERT_TRUE(give(kRootPart, 1).ok());
  EXPECT_EQ(shown(), 0u) << "a part of the first";
  ASSERT_TRUE(give(kRootPart, 2).ok());
  EXPECT_EQ(shown(), 1u);
}

TEST_F(BaseReplicaTest, AnOlderBaseThatWasUnderWayDoesNotComeBack) {
  replica.start(now_s);
  begin();
  replica.take(wire::BaseBegin{kPacker, 2, 0}, now_s);
  EXPECT_FALSE(replica.known());
  asked.clear();
  begin(1);
  ASSERT_TRUE(give(kRootPart).ok());
  replica.tick({}, now_s += 2 * BaseReplica::kPatience_s);
  EXPECT_FALSE(replica.known());
  EXPECT_EQ(shown(), 0u);
  EXPECT_TRUE(asked.empty()) << "there is none";
}

// Words of the root's part and the left node's.
constexpr uint32_t kWord = wire::kBasePart / 64, kRootWord = kRootPart * kWord, kLeftWord = kLeftPart * kWord;

TEST_F(BaseReplicaTest, TellsWhichTrianglesAreHidden) {
  begin();
  ASSERT_TRUE(give(kRootPart).ok());
  const uint64_t before = replica.changes();
  hide(1, {kRootWord, 2, 1});
  EXPECT_NE(replica.changes(), before);
  EXPECT_EQ(hidden(), 0x100000002u);
  hide(2, {kRootWord, 0, 0});
  EXPECT_EQ(hidden(), 0u);
}

TEST_F(BaseReplicaTest, HiddenTrianglesMayBeToldBeforeTheyCome) {
  begin();
  hide(1, {kRootWord, 1, 0});
  ASSERT_TRUE(give(kRootPart).ok());
  EXPECT_EQ(hidden(), 1u);
}

TEST_F(BaseReplicaTest, OlderWordsDoNotReplaceNewerOnes) {
  begin();
  ASSERT_TRUE(give(kRootPart).ok());
  hide(5, {kRootWord, 1, 0});
  hide(4, {kRootWord, 0, 0}, true);
  EXPECT_EQ(hidden(), 1u);
}

TEST_F(BaseReplicaTest, AWholeMessageShowsWhatItDoesNotName) {
  begin();
  ASSERT_TRUE(give(kRootPart).ok());
  hide(1, {kRootWord, 1, 0, kLeftWord, 1, 0});
  hide(2, {kLeftWord, 1, 0}, true);
  EXPECT_EQ(hidden(), 0u);
}

TEST_F(BaseReplicaTest, ALostMessageIsAskedForWithoutParts) {
  begin();
  hide(1, {kRootWord, 1, 0});
  asked.clear();
  hide(3, {kRootWord, 3, 0});
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].parts, 0u);
}

TEST_F(BaseReplicaTest, WordsBeyondTheLastPartAreNotKept) {
  begin();
  const uint64_t before = replica.changes();
  hide(1, {uint32_t(kParts) * kWord, 1, 0, 0xffffffff, 1, 0});
  EXPECT_EQ(replica.changes(), before);
}

TEST_F(BaseReplicaTest, DamagedPartsAreRefused) {
  begin();
  const auto refused = [&](const geometry::ChunkBytes& chunk) {
    return !replica.take(wire::BasePart{kPacker, 1, kRootPart, chunk.bytes}, now_s).ok();
  };
  EXPECT_FALSE(give(kParts).ok()) << "beyond the last one";
  const std::vector<std::byte> damaged(60);
  EXPECT_TRUE(refused({damaged, {}}));
  EXPECT_TRUE(refused(
      test::chunk_of({{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}}, {0, 1, 2}, true)));
  EXPECT_TRUE(refused(chunk(0, 1, kPart - 1)));
  EXPECT_TRUE(refused(chunk(0, 1, kPart + 1)));
  EXPECT_EQ(shown(), 0u);
}

}  // namespace
}  // namespace telesplat::viewer
