// The point model: events, counts of points and bytes, digests.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>

#include "common/points/point_model.h"
#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

constexpr geometry::Rect kTile{0, 0, 320, 200};

PreparedPatch patch(uint64_t sequence, double fraction = 1, const ModelConfig& config = test::scene_config()) {
  std::mt19937_64 random(sequence);
  const geometry::Camera camera = test::scene_camera(test::random_eye(random), kTile.width, kTile.height);
  image::DepthImage image = test::sample_scene(camera, kTile);
  if (fraction < 1) test::mask_randomly(image, fraction, sequence);
  return prepare_patch(config, {sequence}, camera, kTile, image);
}

TEST(ModelConfig, RefusesWhatCannotBeAnOctree) {
  EXPECT_TRUE(validate(test::scene_config()).ok());
  EXPECT_TRUE(validate({{glm::vec3(1), glm::vec3(1)}, 10}).ok());  // a single point
  EXPECT_FALSE(validate({geometry::Box(), 6}).ok());
  EXPECT_FALSE(validate({{glm::vec3(NAN), glm::vec3(1)}, 6}).ok());
  EXPECT_FALSE(validate({{glm::vec3(-INFINITY), glm::vec3(1)}, 6}).ok());
  EXPECT_FALSE(validate({{glm::vec3(0), glm::vec3(1)}, 11}).ok());
  EXPECT_FALSE(validate({{glm::vec3(0), glm::vec3(1)}, -1}).ok());
}

TEST(PointModel, InsertsAndCounts) {
  PointModel model(test::scene_config());
  uint64_t expected = 0;
  for (uint64_t s = 1; s <= 3; ++s) {
    PreparedPatch p = patch(s);
    expected += p.points;
    model.insert(std::move(p));
  }
  EXPECT_EQ(model.points(), expected);
  uint64_t sum = 0;
  for (const auto& [key, cluster] : model.clusters()) {
    EXPECT_EQ(cluster->key, key);
    EXPECT_EQ(cluster->leaf_room, leaf_box(model.config(), key));
    EXPECT_EQ(model.find(key), cluster.get());
    for (size_t i = 1; i < cluster->mosaics.size(); ++i)
      EXPECT_LT(cluster->mosaics[i - 1].sequence(), cluster->mosaics[i].sequence());
    sum += model.points_in(key);
  }
  EXPECT_EQ(sum, expected);
  EXPECT_EQ(model.find(0xfffffff0u), nullptr);
  EXPECT_EQ(model.points_in(0xfffffff0u), 0u);
}

TEST(PointModel, ClustersStayWhereTheyAreOnInsert) {
  PointModel model(test::scene_config());
  model.insert(patch(1));
  std::vector<std::pair<ClusterKey, const Cluster*>> before;
  for (const auto& [key, cluster] : model.clusters()) before.emplace_back(key, cluster.get());
  for (uint64_t s = 2; s < 12; ++s) model.insert(patch(s));
  for (const auto& [key, cluster] : before) EXPECT_EQ(model.find(key), cluster);
}

TEST(PointModel, ForgetDropsClustersWholeAndHandsThemOut) {
  PointModel model(test::scene_config());
  model.insert(patch(1));
  model.insert(patch(2));
  const uint64_t points = model.points();
  const ClusterKey key = model.clusters().begin()->first;
  const uint64_t in_it = model.points_in(key);
  const std::vector<ClusterKey> keys{key, 0xfffffff0u, key};  // one unknown, one twice
  const std::vector<Cluster> dropped = model.forget(keys);
  ASSERT_EQ(dropped.size(), 1u);
  EXPECT_EQ(dropped[0].key, key);
  EXPECT_GT(dropped[0].mosaics.at(0).level(0).count, 0u);
  EXPECT_EQ(model.points(), points - in_it);
  EXPECT_EQ(model.find(key), nullptr);
}

TEST(PointModel, ClustersTakenOutStayDrawable) {
  PointModel model(test::scene_config());
  model.insert(patch(1));
  const ClusterKey key = model.clusters().begin()->first;
  const Cluster* cluster = model.find(key);
  const Mosaic::Level level = cluster->mosaics[0].level(0);
  const auto dropped = model.take_out(std::vector<ClusterKey>{key});
  ASSERT_EQ(dropped.size(), 1u);
  EXPECT_EQ(dropped[0].get(), cluster);
  EXPECT_EQ(cluster->leaf_room, leaf_box(model.config(), key));
  EXPECT_EQ(cluster->mosaics[0].level(0).x, level.x);
  EXPECT_EQ(model.find(key), nullptr);
}

TEST(PointModel, ForgetDropsSinglePatches) {
  PointModel model(test::scene_config()), expected(test::scene_config());
  // Two blocks of frame 1, with a block of frame 2 between them.
  const geometry::Camera camera = test::scene_camera({0.6, 0.4, 0.3}, kTile.width, kTile.height);
  const auto add = [&](PointModel& m, uint64_t sequence, uint64_t frame) {
    m.insert(prepare_patch(m.config(), {sequence}, camera, kTile, test::sample_scene(camera, kTile), {frame}));
  };
  for (const auto& [sequence, frame] : {std::pair{1, 1}, {2, 2}, {3, 1}})
    add(model, uint64_t(sequence), uint64_t(frame));
  add(expected, 2, 2);
  const Mosaic::Level kept = model.clusters().begin()->second->mosaics.at(1).level(0);
  const Mosaic::Level gone = model.clusters().begin()->second->mosaics.at(2).level(0);
  const Cluster* first = model.clusters().begin()->second.get();
  std::vector<ClusterKey> keys{0xfffffff0u, first->key};  // an unknown cluster; a frame that the cluster does not have
  std::vector<uint32_t> frames{1, 7};
  for (const auto& [key, cluster] : model.clusters())
    for (int twice = 0; twice < 2; ++twice) keys.push_back(key), frames.push_back(1);

  const uint64_t points = model.points();
  const auto dropped = model.take_out(keys, frames);
  EXPECT_EQ(dropped.size(), model.clusters().size());
  EXPECT_EQ(model.digest(), expected.digest());
  EXPECT_EQ(model.points(), points / 3);
  EXPECT_EQ(model.find(first->key), first);
  EXPECT_EQ(first->mosaics.at(0).level(0).x, kept.x) << "what stays does not move";
  uint64_t points_dropped = 0;
  bool found = false;
  for (const auto& cluster : dropped) {
    ASSERT_EQ(cluster->mosaics.size(), 2u);
    EXPECT_EQ(cluster->leaf_room, leaf_box(model.config(), cluster->key));
    for (const Mosaic& m : cluster->mosaics) {
      EXPECT_EQ(m.frame_tag(), 1u);
      points_dropped += m.count(0);
      found |= m.level(0).x == gone.x;
    }
  }
  EXPECT_EQ(points_dropped, points - points / 3);
  EXPECT_TRUE(found) << "nor does what was dropped";

  // When its last patch goes, the cluster itself is handed over, at the same place in memory.
  const ClusterKey key = first->key;
  const auto last = model.take_out(std::vector<ClusterKey>{key}, std::vector<uint32_t>{2});
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(last[0].get(), first);
  EXPECT_EQ(model.find(key), nullptr);
  EXPECT_EQ(model.points() + model.points_in(key) + last[0]->mosaics.at(0).count(0), points / 3);
}

TEST(PointModel, ForgettingEverythingIsAnEmptyModel) {
  PointModel model(test::scene_config()), cleared(test::scene_config());
  model.insert(patch(1));
  cleared.insert(patch(1));
  std::vector<ClusterKey> keys;
  for (const auto& [key, cluster] : model.clusters()) keys.push_back(key);
  model.forget(keys);
  cleared.clear();
  EXPECT_EQ(model.points(), 0u);
  EXPECT_EQ(cleared.points(), 0u);
  EXPECT_EQ(model.digest(), PointModel(test::scene_config()).digest());
  EXPECT_EQ(cleared.digest(), model.digest());
  EXPECT_EQ(cleared.bytes(), model.bytes());
}

TEST(PointModel, DigestTellsModelsApartAndNotTheOrderOfTheirClusters) {
  PointModel a(test::scene_config()), b(test::scene_config()), c(test::scene_config());
  // b gets the clusters in another order: it inserts and forgets others first.
  a.insert(patch(1));
  b.insert(patch(9));
  b.clear();
  PreparedPatch reversed = patch(1);
  std::reverse(reversed.mosaics.begin(), reversed.mosaics.end());
  b.insert(std::move(reversed));
  EXPECT_EQ(a.digest(), b.digest());
  c.insert(patch(1));
  c.insert(patch(2, 0.001));
  EXPECT_NE(a.digest(), c.digest());
  PointModel d(test::scene_config());
  PreparedPatch less = patch(1);
  less.mosaics.pop_back();
  d.insert(std::move(less));
  EXPECT_NE(a.digest(), d.digest());
}

TEST(PointModel, BytesAreWhatTheAllocatorGaveOut) {
  const auto in_use = [] { return mallinfo2().uordblks + mallinfo2().hblkhd; };
  {
    std::vector<PreparedPatch> warm;
    warm.push_back(patch(1));
  }  // builds the tables that are built once
  if (in_use() == 0) GTEST_SKIP() << "this allocator does not count (sanitizers)";
  for (const double fraction : {1.0, 0.02}) {
    const size_t before = in_use();
    PointModel model(test::scene_config());
    for (uint64_t s = 1; s <= 20; ++s) model.insert(patch(s, fraction));
    const double real = static_cast<double>(in_use() - before), claimed = static_cast<double>(model.bytes());
    EXPECT_NEAR(claimed / real, 1.0, 0.05) << claimed << " claimed, " << real << " in use";
    std::vector<ClusterKey> keys;
    for (const auto& [key, cluster] : model.clusters())
      if (keys.size() < model.clusters().size() / 2) keys.push_back(key);
    model.forget(keys);
    EXPECT_NEAR(static_cast<double>(model.bytes()) / static_cast<double>(in_use() - before), 1.0, 0.05);
  }
}

// Uncompacted patches: their headers add to the bytes of a point.
class BytesAPoint : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Compact, BytesAPoint, testing::Bool());
TEST_P(BytesAPoint, AreFewEvenInSmallPatches) {
  for (const double fraction : {1.0, 0.3, 0.05, 0.02}) {
    // Frames of 1280x800 over leaves of 1/64: as many points in a leaf as in a session; then fewer, after elimination.
    ModelConfig config = test::scene_config();
    config.compact = GetParam();
    PointModel model(config);
    uint64_t mosaics = 0;
    for (uint64_t s = 1; s <= 6; ++s) {
      std::mt19937_64 random(s);
      const geometry::Rect tile{0, 0, 1280, 800};
      const geometry::Camera camera = test::scene_camera(test::random_eye(random), tile.width, tile.height);
      image::DepthImage image = test::sample_scene(camera, tile);
      test::mask_randomly(image, fraction, s);
      PreparedPatch p = prepare_patch(model.config(), {s}, camera, tile, image);
      mosaics += p.mosaics.size();
      model.insert(std::move(p));
    }
    const double per_point = static_cast<double>(model.bytes()) / static_cast<double>(model.points());
    RecordProperty("bytes_per_point", std::to_string(per_point));
    printf("%.0f %% kept: %.1f points a mosaic, %.1f bytes a point\n", fraction * 100,
           static_cast<double>(model.points()) / static_cast<double>(mosaics), per_point);
    EXPECT_LT(per_point, GetParam() ? 38 : 42);
  }
}

}  // namespace
}  // namespace telesplat::points
