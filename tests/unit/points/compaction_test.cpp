// Merging the mosaics of a cluster: no point is lost, few mosaics are left, and any prefix covers the cluster.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "common/points/compaction.h"
#include "common/points/mosaic_builder.h"
#include "common/points/summary.h"
#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

ModelConfig compact_config() {
  ModelConfig config = test::scene_config();
  config.compact = true;
  return config;
}

// A view of the scene with the share `fraction` of its pixels, as elimination leaves them.
PreparedPatch view(uint64_t sequence, double fraction, int width = 320, double distance = 1, FrameId frame = {}) {
  std::mt19937_64 random(sequence);
  const geometry::Rect tile{0, 0, width, width * 5 / 8};
  const geometry::Camera camera = test::scene_camera(test::random_eye(random) * distance, tile.width, tile.height);
  image::DepthImage image = test::sample_scene(camera, tile);
  test::mask_randomly(image, fraction, sequence);
  return prepare_patch(compact_config(), {sequence}, camera, tile, image, frame.value ? frame : FrameId{sequence});
}

struct Point {
  ClusterKey cluster;
  uint16_t x, y, z, normal;
  uint32_t colour;
  auto operator<=>(const Point&) const = default;
};
void gather(ClusterKey key, const Mosaic& m, std::multiset<Point>& out) {
  const Mosaic::Level l = m.level(0);
  for (uint32_t i = 0; i < l.count; ++i) out.insert({key, l.x[i], l.y[i], l.z[i], l.normal[i], l.colour[i]});
}

TEST(Compaction, KeepsEveryPointAsItWas) {
  PointModel model(compact_config());
  std::multiset<Point> expected, got;
  for (uint64_t s = 1; s <= 40; ++s) {
    PreparedPatch patch = view(s, s % 4 ? 0.03 : 0.4, s % 3 ? 320 : 160, s % 5 ? 1 : 2);
    for (const auto& [key, mosaic] : patch.mosaics) gather(key, mosaic, expected);
    model.insert(std::move(patch));
  }
  for (const auto& [key, cluster] : model.clusters())
    for (const Mosaic& m : cluster->mosaics) gather(key, m, got);
  EXPECT_EQ(got.size(), model.points());
  EXPECT_TRUE(got == expected);
}

TEST(Compaction, ProvisionalMosaicsStayAsTheyCame) {
  PointModel model(compact_config()), without(compact_config());
  std::multiset<Point> expected, got;
  uint64_t provisional = 0;
  for (uint64_t s = 1; s <= 12; ++s) {
    const uint64_t step = s % 3 == 1 ? 4 : 1;
    PreparedPatch patch = view(s, 0.4, 320, step > 1 ? 4 : 1, tagged({s}, step > 1));
    for (const auto& [key, mosaic] : patch.mosaics) {
      EXPECT_EQ(mosaic.provisional(), step > 1);
      EXPECT_EQ(mosaic.frame_tag(), step > 1 ? s | kProvisionalTag : s);
      if (step > 1) gather(key, mosaic, expected), ++provisional;
    }
    if (step == 1) without.insert(view(s, 0.4, 320, 1, tagged({s}, step > 1)));
    model.insert(std::move(patch));
  }
  std::vector<ClusterKey> keys;
  std::vector<uint32_t> frames;
  for (const auto& [key, cluster] : model.clusters())
    for (const Mosaic& m : cluster->mosaics)
      if (m.provisional()) gather(key, m, got), keys.push_back(key), frames.push_back(m.frame_tag());
  EXPECT_EQ(keys.size(), provisional);
  EXPECT_TRUE(got == expected);
  model.forget(keys, frames);
  EXPECT_EQ(model.digest(), without.digest()) << "as if they had never been there";
}

TEST(Compaction, PointsOfARestAreMergedAmongThemselves) {
  PointModel model(compact_config()), without(compact_config()), alone(compact_config());
  for (uint64_t s = 1; s <= 60; ++s) {
    const uint64_t rest = s % 3;  // no rest, then two rests
    model.insert(view(s, 0.4, 320, 1, tagged({s}, false, rest)));
    if (rest == 0) without.insert(view(s, 0.4, 320, 1, tagged({s}, false)));
    if (rest == 1) alone.insert(view(s, 0.4, 320, 1, tagged({s}, false, rest)));
  }
  std::vector<ClusterKey> keys;
  std::vector<uint32_t> frames;
  size_t mosaics = 0, of_rest_1 = 0;
  for (const auto& [key, cluster] : model.clusters()) {
    for (const uint64_t rest : {1, 2}) {
      keys.push_back(key);
      frames.push_back(static_cast<uint32_t>(tagged({}, false, rest).value));
    }
    for (const Mosaic& m : cluster->mosaics) mosaics += m.of_rest(), of_rest_1 += m.group() == frames.end()[-2];
  }
  EXPECT_GT(of_rest_1, 0u);
  EXPECT_LT(mosaics, 8 * model.clusters().size()) << "40 patches of two rests";
  model.forget(keys, frames);
  EXPECT_EQ(model.digest(), without.digest()) << "as if they had never been there";
  EXPECT_GT(alone.points(), 0u);
  for (const auto& [key, cluster] : alone.clusters())
    for (const Mosaic& m : cluster->mosaics) EXPECT_EQ(m.frame_tag(), kRestTag | 1);
}

TEST(Compaction, MosaicsGrowWithTheLogarithmOfPoints) {
  PointModel model(compact_config());
  uint64_t parts = 0;
  for (uint64_t s = 1; s <= 300; ++s) {
    PreparedPatch patch = view(s, 0.01);
    parts += patch.mosaics.size();
    model.insert(std::move(patch));
  }
  size_t mosaics = 0;
  for (const auto& [key, cluster] : model.clusters()) {
    mosaics += cluster->mosaics.size();
    std::map<int, std::vector<uint32_t>> sizes;
    for (const Mosaic& m : cluster->mosaics) sizes[density_class(m.pixel_range())].push_back(m.count(0));
    for (auto& [density, of_class] : sizes) {
      std::sort(of_class.begin(), of_class.end());
      // The two smallest may be waiting for the next mosaic.
      for (size_t i = 2; i < of_class.size(); ++i) EXPECT_GT(of_class[i], of_class[i - 1]) << "class " << density;
    }
  }
  EXPECT_LT(mosaics, 4 * model.clusters().size());
  EXPECT_LT(mosaics * 5, parts) << parts << " parts became " << mosaics << " mosaics";
}

TEST(Compaction, InTwoStepsLeavesTheModelAloneInTheFirst) {
  PointModel model(compact_config()), other(compact_config());
  for (uint64_t s = 1; s <= 12; ++s) {
    const uint64_t digest = model.digest();
    Insertion insertion = model.plan(view(s, 0.1));
    EXPECT_EQ(model.digest(), digest);
    model.commit(std::move(insertion));
    other.insert(view(s, 0.1));
    EXPECT_EQ(model.digest(), other.digest());
  }
}

// n random points on a plane across the leaf, with a pixel range of `density` (samples along the leaf's edge).
Mosaic plane(uint32_t n, float density, uint64_t seed, uint16_t normal = image::encode_normal16({0, 0, 1}),
             uint16_t z = 32768) {
  std::mt19937_64 random(seed);
  MosaicBuilder out({seed}, {seed}, {n, n, n});
  for (uint32_t i = 0; i < n; ++i) {
    out.x[i] = static_cast<uint16_t>(random()), out.y[i] = static_cast<uint16_t>(random()), out.z[i] = z;
    out.normal[i] = normal;
    out.colour[i] = static_cast<uint32_t>(random() & 255);
  }
  return out.finish(density, {0, 0, 1});
}

TEST(Compaction, EveryPrefixCoversTheClusterEvenly) {
  const Mosaic a = plane(2000, 40, 1), b = plane(500, 40, 2);
  const Mosaic merged = merge_mosaics({&a, &b}, Sequence{3});
  ASSERT_EQ(merged.count(0), 2500u);
  EXPECT_LT(merged.count(1), merged.count(0));
  EXPECT_LT(merged.count(2), merged.count(1));
  const Mosaic::Level l = merged.level(0);
  for (const uint32_t n : {merged.count(2), (merged.count(2) + merged.count(1)) / 2, merged.count(1),
                           (merged.count(1) + merged.count(0)) / 2}) {
    // Counts the squares of the plane, about n / 4 of them, that have one of the first n points.
    const auto side = static_cast<uint32_t>(std::max(2.0, std::sqrt(n / 4.0)));
    std::set<uint32_t> seen;
    for (uint32_t i = 0; i < n; ++i) seen.insert((l.x[i] * side >> 16) * side + (l.y[i] * side >> 16));
    EXPECT_GE(seen.size(), side * side * 97 / 100) << "the first " << n << " of " << merged.count(0);
  }
}

TEST(Compaction, CoarseColoursAreMeans) {
  Mosaic a = plane(4000, 20, 5);
  const Mosaic merged = merge_mosaics({&a}, Sequence{6});
  const auto mean = [](const Mosaic::Level& l) {
    double sum = 0;
    for (uint32_t i = 0; i < l.count; ++i) sum += l.colour[i] & 255;
    return sum / l.count;
  };
  const auto spread = [&](const Mosaic::Level& l) {
    double sum = 0;
    for (uint32_t i = 0; i < l.count; ++i) sum += std::pow((l.colour[i] & 255) - mean(merged.level(0)), 2);
    return std::sqrt(sum / l.count);
  };
  // Blue is random in 0..255: the more points a mean is of, the less the means spread.
  EXPECT_NEAR(mean(merged.level(2)), mean(merged.level(0)), 4);
  EXPECT_LT(spread(merged.level(1)), 0.5 * spread(merged.level(0)));
  EXPECT_LT(spread(merged.level(2)), 0.5 * spread(merged.level(1)));
}

TEST(Compaction, BothSidesOfASheetStayAtEveryLevel) {
  const uint16_t front = image::encode_normal16({0, 0, 1}), back = image::encode_normal16({0, 0, -1});
  const Mosaic a = plane(2000, 20, 7, front, 32768), b = plane(2000, 20, 8, back, 32769);
  const Mosaic merged = merge_mosaics({&a, &b}, Sequence{9});
  for (int level = 0; level < kLevels; ++level) {
    const Mosaic::Level l = merged.level(level);
    const auto n = std::count(l.normal, l.normal + l.count, front);
    EXPECT_GT(n * 10, static_cast<ptrdiff_t>(l.count) * 4);
    EXPECT_LT(n * 10, static_cast<ptrdiff_t>(l.count) * 6);
  }
}

TEST(Compaction, FinerPointsTakeInTheCoarseOnesTheySurround) {
  std::vector<Mosaic> cluster;
  cluster.push_back(plane(100, 10, 1));
  // Twice as fine, all over the leaf.
  Merge merge = plan_merge(cluster, plane(800, 20, 2));
  ASSERT_FALSE(merge.replaced.empty());
  uint32_t points = 0, fine = 0;
  for (const Mosaic& m : merge.added) {
    points += m.count(0);
    if (density_class(m.pixel_range()) == density_class(20)) fine += m.count(0);
  }
  EXPECT_EQ(points, 900u) << "none is lost";
  EXPECT_GT(fine, 880u) << "nearly all are surrounded";
  EXPECT_NEAR(merge.added.back().pixel_range(), 20, 0.01);

  // On the other side of the surface: these points do not surround the coarse ones.
  Merge apart = plan_merge(cluster, plane(800, 20, 3, image::encode_normal16({0, 0, -1})));
  EXPECT_TRUE(apart.replaced.empty());
}

// Finer samples come in clumps, as refinement adds them. Outside the clumps, samples keep their range, and so their
// size on the display.
TEST(Compaction, SamplesBesideFinerOnesKeepTheirSize) {
  const ModelConfig config = compact_config();
  PointModel model(config);
  const int width = 256, height = 160, clump = 4;
  const geometry::Camera camera = test::scene_camera({0.35, 0.3, 0.5}, width, height);
  std::mt19937 random(5);
  std::vector<bool> refined(size_t(width / clump) * (height / clump));
  for (size_t i = 0; i < refined.size(); ++i) refined[i] = random() % 100 < 30;
  const auto is_refined = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= height) return false;
    return bool(refined[size_t(y / clump * (width / clump) + x / clump)]);
  };
  const auto patch = [&](uint64_t sequence, int by, const auto& wanted) {
    geometry::Camera fine = camera;
    fine.width *= by, fine.height *= by;
    const geometry::Rect all{0, 0, fine.width, fine.height};
    image::DepthImage image = test::sample_scene(fine, all);
    for (int y = 0; y < fine.height; ++y)
      for (int x = 0; x < fine.width; ++x)
        if (const size_t i = size_t(y) * fine.width + x; !wanted(x / by, y / by))
          image.depth[i] = image.colour[i] = image.normal[i] = 0;
    return prepare_patch(config, {sequence}, fine, all, image, FrameId{sequence});
  };
  // Samples without a finer one beside them, and the range at which they were sampled.
  std::map<Point, float> alone;
  const auto apart = patch(1, 1, [&](int x, int y) {
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i)
        if (is_refined(x + i, y + j)) return false;
    return true;
  });
  for (const auto& [key, mosaic] : apart.mosaics) {
    std::multiset<Point> points;
    gather(key, mosaic, points);
    for (const Point& p : points) alone[p] = mosaic.pixel_range();
  }
  ASSERT_GT(alone.size(), 500u);
  model.insert(patch(1, 1, [](int, int) { return true; }));
  for (uint64_t s = 2; s <= 9; ++s)
    model.insert(patch(s, s % 2 ? 4 : 2,
                       [&](int x, int y) { return is_refined(x, y) && (x / 8 + y / 8) % 4 == int(s / 2 - 1); }));
  size_t found = 0, shrunk = 0;
  for (const auto& [key, cluster] : model.clusters())
    for (const Mosaic& m : cluster->mosaics) {
      std::multiset<Point> points;
      gather(key, m, points);
      for (const Point& p : points)
        if (const auto at = alone.find(p); at != alone.end()) ++found, shrunk += m.pixel_range() > 1.01f * at->second;
    }
  EXPECT_EQ(found, alone.size());
  EXPECT_LT(double(shrunk), 0.02 * double(found));
}

TEST(Summary, HasAPointForEachCellOfTheBlock) {
  PointModel model(compact_config());
  for (uint64_t s = 1; s <= 30; ++s) model.insert(view(s, 0.5, 640));
  size_t summaries = 0;
  for (const auto& [key, brick] : model.bricks()) {
    uint64_t points = 0;
    for (const Cluster* c : brick->clusters) points += model.points_in(c->key);
    if (points <= kMostSummaryPoints) {
      const auto all = summarise(model, key, *brick, Sequence{30});
      EXPECT_EQ(all->cluster.mosaics.at(0).count(0), points);
      continue;
    }
    ++summaries;
    const auto summary = summarise(model, key, *brick, Sequence{30});
    const Mosaic& m = summary->cluster.mosaics.at(0);
    EXPECT_LE(m.pixel_range(), kMostSummaryRange);
    EXPECT_EQ(summary->cluster.leaf_room, brick->box_room);
    EXPECT_LT(m.count(0), points);
    // Each point of the model has a representative within two cells.
    const geometry::Box& box = brick->box_room;
    const float cell = (box.hi.x - box.lo.x) / m.pixel_range();
    std::vector<glm::vec3> representatives;
    const auto at = [](const geometry::Box& b, const Mosaic::Level& l, uint32_t i) {
      return b.lo + (glm::vec3(l.x[i], l.y[i], l.z[i]) + 0.5f) / 65536.0f * b.size();
    };
    for (uint32_t i = 0; i < m.count(0); ++i) representatives.push_back(at(box, m.level(0), i));
    uint64_t far = 0, asked = 0;
    for (const Cluster* c : brick->clusters)
      for (const Mosaic& part : c->mosaics)
        for (uint32_t i = 0; i < part.count(0); i += 37) {
          const glm::vec3 p = at(c->leaf_room, part.level(0), i);
          float nearest = 1e9f;
          for (const glm::vec3& r : representatives) nearest = std::min(nearest, glm::distance(p, r));
          ++asked;
          far += nearest > 2 * cell;
        }
    EXPECT_LE(far * 50, asked) << far << " of " << asked << " have none near";
  }
  EXPECT_GT(summaries, 3u);
}

}  // namespace
}  // namespace telesplat::points
