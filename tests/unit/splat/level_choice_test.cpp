// Transitions between levels: number, choice and size of the points drawn as the head moves.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>

#include "common/geometry/trajectory.h"
#include "common/splat/select/level_choice.h"
#include "common/splat/select/view_selection.h"

namespace telesplat {
namespace {

using points::kLevels;
using splat::SelectionOptions;

constexpr int kSide = 128;

// A wall through the origin, seen from 1 m, in one leaf (depth 0) or many. A point's colour is its pixel's number.
points::PointModel wall(int depth, int phases = 1) {
  points::PointModel model({{{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, depth});
  const geometry::Camera camera = geometry::make_camera(geometry::look_at({0, 0, 1}, {0, 0, 0}), 60, kSide, kSide);
  for (int phase = 0; phase < phases; ++phase) {
    image::DepthImage image(kSide, kSide);
    for (uint32_t i = 0; i < kSide * kSide; ++i) {
      if (static_cast<int>(i % kSide + i / kSide * 3) % phases != phase) continue;
      image.depth[i] = image::encode_depth(1.0, camera.near_m);
      image.colour[i] = i;
      image.normal[i] = image::encode_normal16({0, 0, 1});
    }
    model.insert(
        points::prepare_patch(model.config(), Sequence{uint64_t(phase) + 1}, camera, {0, 0, kSide, kSide}, image));
  }
  return model;
}

const points::Mosaic& only_mosaic(const points::PointModel& model) {
  return model.clusters().begin()->second->mosaics.at(0);
}

geometry::Camera from(double distance) {
  return geometry::make_camera(geometry::look_at({0, 0, distance}, {0, 0, 0}), 60, kSide, kSide);
}

// Largest change of the number of points drawn from one step to the next, as a share of all points.
double largest_jump(const points::PointModel& model, const SelectionOptions& options, double* least = nullptr) {
  double jump = 0, last = -1;
  const auto all = static_cast<double>(model.points());
  splat::DrawList list;
  for (double distance = 1.0; distance < 6.0; distance *= 1.002) {
    splat::select_view(model, from(distance), options, list);
    uint64_t sum = 0;
    for (const auto& item : list.items) sum += item.level.count;
    EXPECT_EQ(sum, list.points);
    const auto now = static_cast<double>(list.points);
    if (last >= 0) jump = std::max(jump, std::abs(now - last) / all);
    last = now;
  }
  if (least) *least = last / all;
  return jump;
}

TEST(LevelTransitions, PointsDrawnAreContinuousInDistance) {
  SelectionOptions smooth, hard;
  hard.transitions = false;
  for (const int depth : {0, 4}) {
    const points::PointModel model = wall(depth);
    double least = 1;
    // A step of 0.2 % in distance is 0.4 % in density, and density passes a factor of 4 within one of 2.
    EXPECT_LT(largest_jump(model, smooth, &least), 0.015) << depth;
    EXPECT_LT(least, 0.11) << "the way leads to the coarsest level";
    EXPECT_GT(largest_jump(model, hard), 0.1) << depth << ": or this test could not fail";
  }
}

TEST(LevelTransitions, SmallMosaicsSwitchOneByOne) {
  const points::PointModel model = wall(5, 16);
  size_t mosaics = 0;
  for (const auto& [key, cluster] : model.clusters())
    for (const auto& m : cluster->mosaics) {
      ++mosaics;
      ASSERT_LT(m.count(0), splat::kSmallStep);
    }
  ASSERT_GT(mosaics, 1000u);
  SelectionOptions smooth, hard;
  hard.transitions = false;
  EXPECT_LT(largest_jump(model, smooth), 0.015);
  EXPECT_GT(largest_jump(model, hard), 0.05) << "or this test could not fail";
  splat::DrawList list;
  splat::select_view(model, from(1.4), smooth, list);
  std::set<uint32_t> levels;
  for (const auto& item : list.items) {
    EXPECT_EQ(item.first, 0u);
    levels.insert(item.level.count);
  }
  EXPECT_LE(list.items.size(), mosaics) << "one item each";
  EXPECT_GT(levels.size(), 1u);
}

TEST(LevelTransitions, MeetTheLevelsAtBothEnds) {
  const points::PointModel model = wall(0);
  const points::Mosaic& m = only_mosaic(model);
  const float begin = splat::kTransitionBegin, end = splat::kTransitionEnd;
  EXPECT_NEAR(begin * end, 0.5f, 1e-6f) << "about the ratio at which the closest level changes";
  const auto expect = [&](float wanted, uint32_t count, uint32_t mean, int fine, float spacing) {
    const splat::Drawn d = splat::between_levels(m, wanted, 0.5f);
    EXPECT_NEAR(d.count, count, 1 + 0.001 * count) << wanted;
    EXPECT_NEAR(d.mean, mean, 1 + 0.001 * mean) << wanted;
    EXPECT_EQ(d.fine, fine) << wanted;
    EXPECT_NEAR(d.spacing, spacing, 1e-3f * spacing) << wanted;
    EXPECT_NEAR(d.widest, spacing, 1e-3f * spacing) << wanted;
  };
  expect(3.0f, m.count(0), 0, 0, 1);
  expect(end, m.count(0), 0, 0, 1);
  expect(end * 0.99999f, m.count(0), 0, 0, 1);
  expect(begin * 1.00001f, m.count(1), m.count(1), 0, 2);  // all in the mean colours of level 1 ...
  expect(begin, m.count(1), 0, 1, 2);                      // ... which are level 1's own
  expect(end / 2 * 1.00001f, m.count(1), 0, 1, 2);
  expect(end / 2 * 0.99999f, m.count(1), 0, 1, 2);
  expect(begin / 2 * 1.00001f, m.count(2), m.count(2), 1, 4);
  expect(begin / 2, m.count(2), 0, 2, 4);
  expect(0.01f, m.count(2), 0, 2, 4);
  for (float wanted = 0.2f; wanted < 1; wanted *= 1.01f) {
    const splat::Drawn d = splat::between_levels(m, wanted, 0.5f);
    EXPECT_LE(d.mean, d.count);
    EXPECT_LE(d.mean, d.fine < 2 ? m.count(d.fine + 1) : 0);
    EXPECT_NEAR(d.count * d.spacing * d.spacing, m.count(0), 0.002 * m.count(0)) << "density is 1 / spacing^2";
    EXPECT_GE(d.widest, d.spacing * 0.999f) << wanted;
    EXPECT_LE(d.widest, d.spacing * 1.42f) << wanted;
  }
}

// widest_spacing holds for the points themselves: no sample is farther from a drawn point than half the diagonal of a
// square cell of that side, plus 0.42 pixels.
TEST(LevelTransitions, SplatsOfTheWidestSpacingBridgeTheGaps) {
  const points::PointModel model = wall(0);
  const points::Mosaic& m = only_mosaic(model);
  const points::Mosaic::Level level = m.level(0);
  for (float wanted = 0.5f; wanted < 0.9f; wanted *= 1.02f) {
    const splat::Drawn d = splat::between_levels(m, wanted, 0.5f);
    std::vector<bool> drawn(kSide * kSide);
    for (uint32_t i = 0; i < d.count; ++i) drawn[level.colour[i]] = true;
    double farthest2 = 0;
    for (int y = 8; y < kSide - 8; ++y)
      for (int x = 8; x < kSide - 8; ++x) {
        int nearest2 = 100;
        for (int j = -3; j <= 3; ++j)
          for (int i = -3; i <= 3; ++i)
            if (drawn[(y + j) * kSide + x + i]) nearest2 = std::min(nearest2, i * i + j * j);
        farthest2 = std::max<double>(farthest2, nearest2);
      }
    // The last few holes of a rank are passed over: at most a fifth of the points come while the size ramps.
    EXPECT_LE(std::sqrt(farthest2), std::max(1.0, d.widest * 0.70711 + 0.42)) << wanted;
  }
}

TEST(LevelTransitions, EveryPrefixIsSpreadEvenly) {
  const points::PointModel model = wall(0);
  const points::Mosaic::Level level = only_mosaic(model).level(0);
  ASSERT_EQ(level.count, uint32_t(kSide * kSide));
  for (const uint32_t blocks : {1u, 2u, 8u}) {  // windows of 4, 8, 32 pixels
    const uint32_t side = 4 * blocks, columns = kSide / side;
    std::vector<uint32_t> drawn(columns * columns);
    uint32_t done = 0;
    for (uint32_t n = 0; n <= level.count; n += kSide * kSide / 16) {
      for (; done < n; ++done) ++drawn[level.colour[done] / kSide / side * columns + level.colour[done] % kSide / side];
      const auto [least, most] = std::minmax_element(drawn.begin(), drawn.end());
      EXPECT_EQ(*least, *most) << n << " points, windows of " << side;
    }
  }
  // Half of the points: every pixel is drawn or beside a drawn one.
  std::vector<bool> half(kSide * kSide);
  for (uint32_t i = 0; i < level.count / 2; ++i) half[level.colour[i]] = true;
  for (uint32_t i = 0; i + 1 < kSide * kSide; ++i) {
    if (i % kSide + 1 < kSide) {
      EXPECT_NE(half[i], half[i + 1]) << i;
    }
  }
}

// An item names the arrays that it is a part of; they stay the same, so that a renderer can keep its copies.
TEST(LevelTransitions, ItemsArePartsOfLevelsThatStayTheSame) {
  const points::PointModel model = wall(2);
  size_t partial = 0, pairs = 0;
  for (double distance = 0.9; distance < 5; distance *= 1.1) {
    splat::DrawList list;
    splat::select_view(model, from(distance), {}, list);
    std::map<const uint16_t*, uint32_t> drawn_to;  // for each mosaic
    for (size_t i = 0; i < list.items.size(); ++i) {
      const splat::DrawItem& item = list.items[i];
      const points::Mosaic::Level whole = item.arrays();
      const points::Mosaic* mosaic = nullptr;
      int l = 0;
      for (const points::Mosaic& m : item.cluster->mosaics)
        for (int k = kLevels - 1; k >= 0; --k)
          if (m.level(k).colour == whole.colour && m.count(k) == whole.count) mosaic = &m, l = k;
      ASSERT_TRUE(mosaic);
      const points::Mosaic::Level level = mosaic->level(l);
      EXPECT_EQ(whole.x, level.x);
      EXPECT_EQ(whole.y, level.y);
      EXPECT_EQ(whole.z, level.z);
      EXPECT_EQ(whole.normal, level.normal);
      EXPECT_LE(item.first + item.level.count, whole.count);
      EXPECT_EQ(item.level.x, level.x + item.first);
      EXPECT_EQ(item.level.colour, level.colour + item.first);
      uint32_t& to = drawn_to[level.x];
      EXPECT_EQ(item.first, to) << "parts follow each other";
      if (to > 0) {
        ++pairs;
        EXPECT_EQ(list.items[i - 1].cluster, item.cluster);
        EXPECT_EQ(list.items[i - 1].splat_px, item.splat_px);
        EXPECT_EQ(list.items[i - 1].radius_m, item.radius_m);
      }
      to += item.level.count;
      partial += item.level.count < whole.count;
    }
  }
  EXPECT_GT(partial, 10u);
  EXPECT_GT(pairs, 10u);
}

TEST(LevelTransitions, LessDetailDropsPointsOfMagnifiedMosaicsToo) {
  const points::PointModel model = wall(3);
  SelectionOptions options;
  splat::DrawList full, less;
  splat::select_view(model, from(0.4), options, full);
  uint64_t last = full.points;
  for (const float detail : {0.8f, 0.7f, 0.6f}) {
    options.detail = detail;
    splat::select_view(model, from(0.4), options, less);
    EXPECT_LT(less.points, last) << detail;
    EXPECT_GT(less.items[0].splat_px, full.items[0].splat_px);
    last = less.points;
  }
  options.detail = 0.5f;
  splat::select_view(model, from(0.4), options, less);
  EXPECT_NEAR(double(less.points), 0.27 * double(full.points), 0.03 * double(full.points));
  EXPECT_NEAR(less.items[0].splat_px, full.items[0].splat_px * 2, 0.01f);
  EXPECT_NEAR(less.items[0].radius_m, full.items[0].radius_m * 2, 0.01f * full.items[0].radius_m);
}

// A low-rate mosaic beside a high-rate one: its revised size (T4.4.3) changes with the distance without a jump.
TEST(LevelTransitions, RevisedSizesAreContinuousToo) {
  points::PointModel model({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 0});
  uint64_t sequence = 0;
  for (const auto& [distance, pixels] : {std::pair{2.0, 24}, {1.0, 90}}) {
    const geometry::Camera camera = from(distance);
    image::DepthImage image(kSide, kSide);
    for (int y = 0; y < pixels; ++y)
      for (int x = 0; x < pixels; ++x) {
        const size_t i = size_t(64 - pixels / 2 + y) * kSide + 64 - pixels / 2 + x;
        image.depth[i] = image::encode_depth(distance, camera.near_m);
        image.normal[i] = image::encode_normal16({0, 0, 1});
      }
    model.insert(points::prepare_patch(model.config(), Sequence{++sequence}, camera, {0, 0, kSide, kSide}, image));
  }
  const auto sizes = [&](double distance, bool transitions) {
    SelectionOptions options;
    options.transitions = transitions;
    splat::DrawList list;
    splat::select_view(model, from(distance), options, list);
    std::array<float, 2> out{};
    for (const auto& item : list.items) out[item.sequence.value - 1] = item.radius_m;
    return out;
  };
  for (const bool transitions : {true, false}) {
    double jump = 0;
    bool revised = false;
    std::array<float, 2> last = sizes(0.8, transitions);
    for (double distance = 0.8; distance < 3; distance *= 1.002) {
      const auto now = sizes(distance, transitions);
      for (int i = 0; i < 2; ++i) jump = std::max<double>(jump, std::abs(std::log(now[i] / last[i])));
      revised |= now[0] < 1.9f * now[1] && now[0] > 1.05f * now[1];
      last = now;
    }
    EXPECT_TRUE(revised);
    if (transitions)
      EXPECT_LT(jump, 0.03);
    else
      EXPECT_GT(jump, 0.3);
  }
}

}  // namespace
}  // namespace telesplat
