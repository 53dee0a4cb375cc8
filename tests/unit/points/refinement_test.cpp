// Points with bounded errors become exact, also after merging has moved them.
#include "common/points/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

ModelConfig config(bool compact) {
  ModelConfig out = test::scene_config(4);
  out.compact = compact;
  return out;
}

// A view: exact, and with errors.
struct View {
  geometry::Camera camera;
  geometry::Rect tile{0, 0, 96, 64};
  image::DepthImage exact, bounded;
};

View view(uint64_t seed, double fraction) {
  std::mt19937_64 random(seed);
  View out;
  out.camera = test::scene_camera(test::random_eye(random), out.tile.width, out.tile.height);
  out.exact = test::sample_scene(out.camera, out.tile);
  test::mask_randomly(out.exact, fraction, seed);
  out.bounded = out.exact;
  for (size_t i = 0; i < out.exact.pixels(); ++i) {
    if (out.exact.depth[i] == 0) continue;
    const auto error = static_cast<int64_t>(out.exact.depth[i] / 20000);
    const int64_t code = out.exact.depth[i] - error + static_cast<int64_t>(random() % (2 * error + 1));
    out.bounded.depth[i] = static_cast<uint32_t>(std::clamp<int64_t>(code, 1, image::kMaxDepthCode));
    out.bounded.colour[i] ^= random() & 0x010101;
    out.bounded.normal[i] ^= random() & 1;
  }
  return out;
}

struct Point {
  ClusterKey cluster;
  uint16_t x, y, z, normal;
  uint32_t colour;
  auto operator<=>(const Point&) const = default;
};

std::multiset<Point> points_of(const PointModel& model) {
  std::multiset<Point> out;
  for (const auto& [key, cluster] : model.clusters())
    for (const Mosaic& m : cluster->mosaics) {
      const Mosaic::Level l = m.level(0);
      for (uint32_t i = 0; i < l.count; ++i) out.insert({key, l.x[i], l.y[i], l.z[i], l.normal[i], l.colour[i]});
    }
  return out;
}

// Points of a that b lacks.
std::vector<Point> differences(const std::multiset<Point>& a, const std::multiset<Point>& b) {
  std::vector<Point> only;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(only));
  return only;
}

class Refinement : public testing::TestWithParam<bool> {};

TEST_P(Refinement, MakesAModelOfWhatWasSampled) {
  const ModelConfig c = config(GetParam());
  PointModel bounded(c), exact(c);
  std::vector<View> views;
  uint64_t sequence = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const View& v = views.emplace_back(view(seed, seed % 4 == 1 ? 0.9 : 0.2));
    ++sequence;
    bounded.insert(prepare_patch(c, {sequence}, v.camera, v.tile, v.bounded, {seed}));
    exact.insert(prepare_patch(c, {sequence}, v.camera, v.tile, v.exact, {seed}));
  }
  const uint64_t points = bounded.points();
  const auto wanted = points_of(exact);
  EXPECT_GT(differences(points_of(bounded), wanted).size(), points * 9 / 10);
  for (uint64_t seed = views.size(); seed > 0; --seed) {
    const View& v = views[seed - 1];
    const auto refinement = prepare_refinement(c, {++sequence}, {seed}, {v.camera, v.tile, v.bounded, v.exact});
    EXPECT_GT(refinement.points(), 100u);
    bounded.commit(plan_refinement(bounded, refinement));
  }
  EXPECT_EQ(bounded.points(), points);
  const auto others = differences(points_of(bounded), wanted);
  EXPECT_LT(others.size(), points / 50);
  const auto at_a_side = [](uint16_t q) { return q == 0 || q == 65535; };
  for (const Point& p : others)
    EXPECT_TRUE(at_a_side(p.x) || at_a_side(p.y) || at_a_side(p.z)) << "beyond the side it would be in another leaf";
  uint64_t counted = 0;
  for (const auto& [key, cluster] : bounded.clusters())
    for (const Mosaic& m : cluster->mosaics) counted += m.count(0);
  EXPECT_EQ(counted, points);
}

TEST_P(Refinement, OfNothingThatIsThereChangesNothing) {
  const ModelConfig c = config(GetParam());
  const View v = view(3, 0.5), other = view(4, 0.5);
  PointModel model(c);
  model.insert(prepare_patch(c, {1}, other.camera, other.tile, other.bounded, {1}));
  const uint64_t digest = model.digest();
  const auto refinement = prepare_refinement(c, {3}, {2}, {v.camera, v.tile, v.bounded, v.exact});
  EXPECT_TRUE(plan_refinement(model, refinement).changes.empty());
  model.commit(plan_refinement(model, refinement));
  EXPECT_EQ(model.digest(), digest);
}

TEST_P(Refinement, OfWhatIsExactSaysNothing) {
  const View v = view(5, 0.5);
  EXPECT_TRUE(prepare_refinement(config(GetParam()), {2}, {1}, {v.camera, v.tile, v.exact, v.exact}).parts.empty());
}

TEST_P(Refinement, KeepsTheMemoryThatTheModelCounts) {
  const ModelConfig c = config(GetParam());
  PointModel model(c);
  const View v = view(6, 0.9);
  model.insert(prepare_patch(c, {1}, v.camera, v.tile, v.bounded, {1}));
  model.commit(plan_refinement(model, prepare_refinement(c, {2}, {1}, {v.camera, v.tile, v.bounded, v.exact})));
  PointModel again(c);
  std::vector<ClusterKey> keys;
  for (const auto& [key, cluster] : model.clusters()) keys.push_back(key);
  model.forget(keys);
  EXPECT_EQ(model.points(), 0u);
  // The tables keep their allocations; the bytes of mosaics are all freed.
  EXPECT_LT(model.bytes(), again.bytes() + 64 * keys.size() + 4096);
}

INSTANTIATE_TEST_SUITE_P(MergedOrNot, Refinement, testing::Bool());

}  // namespace
}  // namespace telesplat::points
