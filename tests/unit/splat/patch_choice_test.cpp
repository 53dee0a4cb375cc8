// Redundant patches: the choice of a cluster's patches to draw (T4.4.3.3).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/geometry/trajectory.h"
#include "common/splat/select/patch_choice.h"
#include "common/splat/select/view_selection.h"

namespace telesplat {
namespace {

constexpr int kSide = 256;
constexpr double kFov_deg = 60;

geometry::Camera camera_from(const glm::dvec3& eye) {
  return geometry::make_camera(geometry::look_at(eye, {0, 0, 0}), kFov_deg, kSide, kSide);
}

// A square of 0.5 m in the plane z = 0, in one cluster around the origin, sampled from several eyes.
class Square {
 public:
  // At depth > 0 the square lies on no leaf's face.
  explicit Square(int depth = 0)
      : model_({{{-0.4f, -0.4f, depth ? -0.3687f : -0.4f}, {0.4f, 0.4f, depth ? 0.4313f : 0.4f}}, depth}) {}

  /// Samples the part of the square with x in [x0, x1) as one frame of `tiles` tiles side by side: every step-th
  /// pixel of every step-th row.
  void add(const glm::dvec3& eye, double x0 = -0.25, double x1 = 0.25, int tiles = 1, int step = 1) {
    ++frame_;
    for (int tile = 0; tile < tiles; ++tile) add_tile(frame_, eye, tile, tiles, x0, x1, step);
  }
  void add_tile(uint64_t frame, const glm::dvec3& eye, int tile, int tiles, double x0 = -0.25, double x1 = 0.25,
                int step = 1) {
    frame_ = std::max(frame_, frame);
    const geometry::Camera camera = geometry::subsample(camera_from(eye), step);
    const glm::dvec3 backward = camera.pose.orientation * glm::dvec3(0, 0, 1);
    const int width = camera.width / tiles;
    image::DepthImage image(width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < width; ++x) {
        const glm::dvec3 ray = camera.unproject(tile * width + x + 0.5, y + 0.5, 1.0) - eye;
        const glm::dvec3 hit = eye - ray * (eye.z / ray.z);
        if (hit.x < x0 || hit.x >= x1 || std::abs(hit.y) > 0.25) continue;
        const size_t i = size_t(y) * width + x;
        image.depth[i] = image::encode_depth(glm::dot(eye - hit, backward), camera.near_m);
        image.normal[i] = image::encode_normal16({0, 0, 1});
      }
    model_.insert(points::prepare_patch(model_.config(), Sequence{++sequence_}, camera,
                                        {tile * width, 0, width, camera.height}, image, FrameId{frame}));
  }
  const points::PointModel& model() const { return model_; }
  const points::Cluster& cluster() const { return *model_.clusters().begin()->second; }

  /// Frames that have points in the draw list.
  std::set<uint32_t> drawn(const glm::dvec3& eye) const {
    splat::SelectionOptions options;
    options.best_patch_only = true;
    splat::DrawList list;
    splat::select_view(model_, camera_from(eye), options, list);
    std::set<uint32_t> frames;
    for (const auto& item : list.items)
      for (const auto& m : item.cluster->mosaics)
        if (m.sequence() == item.sequence) frames.insert(m.frame_tag());
    return frames;
  }

 private:
  points::PointModel model_;
  uint64_t sequence_ = 0, frame_ = 0;
};

using Frames = std::set<uint32_t>;

TEST(SurfelQuality, IsThatOfTheContoursRadii) {
  const double focal = camera_from({0, 0, 1}).focal_x();
  for (const double sampled : {0.8, 1.6, 3.0})
    for (const double displayed : {0.7, 1.5}) {
      Square square;
      square.add({0, 0, sampled});
      const auto& m = square.cluster().mosaics.at(0);
      const double q =
          splat::surfel_quality(m, square.cluster().leaf_room, splat::patch_view(camera_from({0, 0, displayed})));
      const double radius_px = 0.5 * sampled / focal * focal / displayed, r = std::sqrt(radius_px * radius_px + 0.25);
      EXPECT_NEAR(q, 1 / r, 0.01 / r) << sampled << " " << displayed;
    }
  // Sampled at 45 degrees: stretched by sqrt 2 in one direction; seen from there again it is round.
  Square square;
  square.add({std::sqrt(0.5), 0, std::sqrt(0.5)});
  const auto& m = square.cluster().mosaics.at(0);
  const auto quality = [&](const glm::dvec3& eye) {
    return splat::surfel_quality(m, square.cluster().leaf_room, splat::patch_view(camera_from(eye)));
  };
  const double r1 = std::sqrt(0.25 + 0.25), r0 = std::sqrt(0.5 + 0.25);
  EXPECT_NEAR(quality({0, 0, 1}), r1 / r0 / r0, 0.03);
  EXPECT_NEAR(quality({std::sqrt(0.5), 0, std::sqrt(0.5)}), 1 / r1, 0.1)
      << "nearer samples being denser, the centroid is nearer too";
  EXPECT_EQ(splat::surfel_quality(
                m, square.cluster().leaf_room,
                splat::patch_view(geometry::make_camera(geometry::look_at({0, 0, 1}, {0, 0, 2}), 60, 64, 64))),
            0.0f)
      << "behind the camera";
}

TEST(SurfelQuality, CoverageIsTheArea) {
  for (const glm::dvec3& eye : {glm::dvec3(0, 0, 1), {0, 0, 2}, {0.7, 0, 0.7}, {0, 1, 1}}) {
    Square square;
    square.add(eye);
    EXPECT_NEAR(splat::surface_covered(square.cluster().mosaics.at(0)), 0.25 / (0.8008 * 0.8008), 0.04);
  }
}

TEST(PatchChoice, TheBestIsDrawnAlone) {
  Square square;
  square.add({0, 0, 2});
  square.add({0, 0, 0.8});
  square.add({1.9, 0, 0.75});
  square.add({0, 0, 1.2});
  EXPECT_EQ(square.drawn({0, 0, 0.7}), Frames{2}) << "the finest that is round";
  splat::DrawList all;
  splat::select_view(square.model(), camera_from({0, 0, 0.7}), {}, all);
  EXPECT_GE(all.items.size(), 4u) << "without the option, all";
}

TEST(PatchChoice, WhatTheBestDoesNotShowIsShownByOthers) {
  Square square;
  square.add({0, 0, 1.6});
  square.add({0, 0, 0.8}, -0.25, 0.0);  // better, but half of it
  EXPECT_EQ(square.drawn({0, 0, 0.7}), (Frames{1, 2}));
  square.add({0, 0, 0.85}, 0.0, 0.25);  // as large as the other half
  EXPECT_TRUE(square.drawn({0, 0, 0.7}).contains(2));
  EXPECT_TRUE(square.drawn({0, 0, 0.7}).contains(3));
  square.add({0, 0, 0.75});
  EXPECT_EQ(square.drawn({0, 0, 0.7}), Frames{4});
}

TEST(PatchChoice, TilesOfOneFrameAreOnePatch) {
  Square square;
  square.add({0, 0, 1.6});
  square.add({0, 0, 0.8}, -0.25, 0.25, 4);
  splat::SelectionOptions options;
  options.best_patch_only = true;
  splat::DrawList list;
  splat::select_view(square.model(), camera_from({0, 0, 0.7}), options, list);
  std::set<uint64_t> sequences;
  for (const auto& item : list.items) sequences.insert(item.sequence.value);
  EXPECT_EQ(sequences, (std::set<uint64_t>{2, 3, 4, 5})) << "all four tiles of the better frame, nothing else";
}

TEST(PatchChoice, BlocksOfFramesThatComeInTurnsAreTheirPatches) {
  Square square;
  for (int tile = 0; tile < 4; ++tile)
    for (const auto& [frame, distance] : {std::pair{1, 1.6}, {2, 0.8}, {3, 1.2}})
      square.add_tile(uint64_t(frame), {0, 0, distance}, tile, 4);
  EXPECT_EQ(square.drawn({0, 0, 0.7}), Frames{2});
}

TEST(PatchChoice, CoarsePatchesLoseToFineOnesOfNearlyTheSameView) {
  for (const int depth : {3, 4, 5}) {  // down to two coarse samples across a leaf
    for (const glm::dvec3& eye : {glm::dvec3(0, 0, 0.8), {0.3, 0.2, 0.9}, {-0.5, 0.1, 0.7}}) {
      Square square(depth);
      square.add(eye, -0.25, 0.25, 1, 4);
      square.add(eye + glm::dvec3(0.01, -0.01, 0.01));
      square.add(eye + glm::dvec3(-0.01, 0, 0), -0.25, 0.25, 1, 4);
      for (const double nearer : {1.0, 0.8}) {
        splat::SelectionOptions options;
        options.best_patch_only = true;
        splat::DrawList list;
        splat::select_view(square.model(), camera_from(eye * nearer), options, list);
        size_t inside = 0, coarse = 0, fine = 0;
        for (size_t i = 0; i < list.frames_seen.size(); ++i) {
          // In leaves at the square's border, which runs along the rows, coarse samples may reach farther.
          const geometry::Box& leaf = square.model().find(list.clusters_seen[i])->leaf_room;
          const bool is_inside =
              std::max({std::abs(leaf.lo.x), std::abs(leaf.hi.x), std::abs(leaf.lo.y), std::abs(leaf.hi.y)}) < 0.25f;
          inside += is_inside;
          fine += is_inside && list.frames_seen[i] == 2;
          coarse += is_inside && list.frames_seen[i] != 2;
        }
        EXPECT_GT(fine, 10u);
        // Where a leaf has less than two coarse samples a side, a few coarse patches still win.
        EXPECT_LE(coarse, depth < 5 ? 0 : inside / 30)
            << "of " << inside << ", depth " << depth << " from " << eye.x << " " << nearer;
      }
    }
  }
}

TEST(PatchChoice, AFinePatchFromTheSideDoesNotReplaceABetterOne) {
  for (const int depth : {0, 3}) {
    Square square(depth);
    square.add({0, 0, 1.4});      // not as fine, but seen straight on
    square.add({0.62, 0, 0.12});  // near, at a low angle
    const Frames drawn = square.drawn({0, 0, 0.7});
    EXPECT_TRUE(drawn.contains(1)) << depth;
    EXPECT_EQ(square.drawn({0, 0, 1.4}), Frames{1}) << depth;
  }
}

// While half of a frame is there, an older frame is drawn where the new one has no points yet: no leaf loses much of
// the area that it showed.
TEST(PatchChoice, WhatAFrameHasNotBroughtYetIsShownByOlderOnes) {
  for (const int step : {1, 4}) {
    const glm::dvec3 eye(0.1, 0, 0.8);
    for (int half = 1; half < 8; ++half) {
      Square square(3);
      square.add(eye, -0.25, 0.25, 1, step);
      for (int tile = 0; tile < half; ++tile) square.add_tile(2, eye + glm::dvec3(0.01, 0, -0.02), tile, 8);
      splat::SelectionOptions options;
      options.best_patch_only = true, options.transitions = false;
      splat::DrawList list;
      splat::select_view(square.model(), camera_from(eye), options, list);
      for (const auto& [key, cluster] : square.model().clusters()) {
        std::set<Sequence> drawn;
        for (const auto& item : list.items)
          if (item.cluster == cluster.get()) drawn.insert(item.sequence);
        // Steps of a sixteenth of the leaf along x: `has` where there are points, `shown` where points are drawn.
        std::array<bool, 16> has{}, shown{};
        for (const auto& m : cluster->mosaics)
          for (uint32_t i = 0; i < m.count(0); ++i) {
            const size_t at = m.level(0).x[i] >> 12;
            has[at] = true;
            shown[at] = shown[at] || drawn.contains(m.sequence());
          }
        int lost = 0;
        for (size_t i = 0; i < has.size(); ++i) lost += has[i] && !shown[i];
        EXPECT_LE(lost, 5) << "step " << step << ", " << half << " of 8 tiles, cluster " << key;
      }
    }
  }
}

TEST(PatchChoice, PatchesDrawnAreToldForAccessReports) {
  Square square(3);
  square.add({0, 0, 1.6});
  square.add({0, 0, 0.8}, -0.25, 0.05, 2);
  splat::SelectionOptions options;
  splat::DrawList list;
  splat::select_view(square.model(), camera_from({0, 0, 0.9}), options, list);
  EXPECT_TRUE(list.frames_seen.empty());
  EXPECT_FALSE(list.clusters_seen.empty());
  options.best_patch_only = true;
  splat::select_view(square.model(), camera_from({0, 0, 0.9}), options, list);
  ASSERT_EQ(list.clusters_seen.size(), list.frames_seen.size());
  std::set<std::pair<points::ClusterKey, uint32_t>> told, drawn;
  for (size_t i = 0; i < list.frames_seen.size(); ++i)
    EXPECT_TRUE(told.insert({list.clusters_seen[i], list.frames_seen[i]}).second) << "each once";
  for (const auto& item : list.items)
    for (const auto& m : item.cluster->mosaics)
      if (m.sequence() == item.sequence) drawn.insert({item.cluster->key, m.frame_tag()});
  EXPECT_EQ(told, drawn);
  std::set<uint32_t> frames;
  for (const auto& [key, frame] : told) frames.insert(frame);
  EXPECT_EQ(frames, (Frames{1, 2}));
}

TEST(PatchChoice, EveryClusterShowsSomething) {
  Square square(4);
  for (int i = 0; i < 12; ++i)
    square.add({std::sin(i * 0.4) * 0.9, 0.3 * std::cos(i * 1.1), 0.5 + 0.1 * i}, -0.25 + 0.02 * i, 0.25 - 0.01 * i);
  splat::SelectionOptions options;
  splat::DrawList all, best;
  splat::select_view(square.model(), camera_from({0.1, 0.1, 0.7}), options, all);
  options.best_patch_only = true;
  splat::select_view(square.model(), camera_from({0.1, 0.1, 0.7}), options, best);
  const auto clusters = [](const splat::DrawList& list) {
    std::set<points::ClusterKey> keys;
    for (const auto& item : list.items) keys.insert(item.cluster->key);
    return keys;
  };
  EXPECT_EQ(clusters(best), clusters(all));
  EXPECT_LT(best.points * 2, all.points) << "of a dozen patches, many of them partial";
}

TEST(MosaicFrame, IsKeptModulo2To24AndDigested) {
  const geometry::Camera camera = camera_from({0, 0, 1});
  image::DepthImage image(8, 8);
  for (auto& d : image.depth) d = image::encode_depth(1.0, camera.near_m);
  const points::ModelConfig config{{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 0};
  const auto digest = [&](uint64_t sequence, uint64_t frame) {
    points::PointModel model(config);
    model.insert(points::prepare_patch(config, {sequence}, camera, {124, 124, 8, 8}, image, {frame}));
    const auto& m = model.clusters().begin()->second->mosaics.at(0);
    EXPECT_EQ(m.sequence().value, sequence % (1ull << 40));
    EXPECT_EQ(m.frame_tag(), frame % (1u << 24));
    return model.digest();
  };
  EXPECT_EQ(digest(7, 9), digest(7, 9));
  EXPECT_NE(digest(7, 9), digest(7, 10));
  EXPECT_NE(digest(7, 9), digest(8, 9));
  digest((1ull << 40) - 1, (1u << 24) - 1);
  digest((1ull << 40) + 5, (1ull << 24) + 3);
}

}  // namespace
}  // namespace telesplat
