// Selection for a view, against a search through all mosaics.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <set>

#include "common/geometry/stereo.h"
#include "common/geometry/trajectory.h"
#include "common/splat/select/view_selection.h"
#include "tests/support/eye_cameras.h"
#include "tests/support/splat_scene.h"

namespace telesplat {
namespace {

using splat::DrawList;
using splat::SelectionOptions;

// A sphere of radius 0.3 m, sampled by cameras around it at several distances.
image::DepthImage sphere_image(const geometry::Camera& camera, int phase, int phases) {
  image::DepthImage out(camera.width, camera.height);
  const glm::dvec3 eye = camera.pose.position_room;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if ((x + y) % phases != phase) continue;
      const glm::dvec3 ray = camera.unproject(x + 0.5, y + 0.5, 1.0) - eye;
      const double a = glm::dot(ray, ray), b = glm::dot(ray, eye), c = glm::dot(eye, eye) - 0.09;
      if (b * b - a * c < 0) continue;
      const double depth = (-b - std::sqrt(b * b - a * c)) / a;
      const size_t i = size_t(y) * camera.width + x;
      out.depth[i] = image::encode_depth(depth, camera.near_m);
      out.normal[i] = image::encode_normal16(glm::vec3(glm::normalize(eye + ray * depth)));
    }
  return out;
}

points::PointModel sphere_model() {
  points::PointModel model({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 4});
  uint64_t sequence = 0;
  for (int i = 0; i < 9; ++i) {
    const double angle = i * 2.1, distance = 0.5 + 0.2 * i;
    const geometry::Camera camera = geometry::make_camera(
        geometry::look_at({distance * std::sin(angle), 0.2 * (i % 3), distance * std::cos(angle)}, {0, 0, 0}), 60, 160,
        120);
    model.insert(points::prepare_patch(model.config(), Sequence{++sequence}, camera, {0, 0, 160, 120},
                                       sphere_image(camera, i % 2, 2)));
  }
  return model;
}

geometry::Camera view(double angle, double distance) {
  return geometry::make_camera(
      geometry::look_at({distance * std::sin(angle), 0.1, distance * std::cos(angle)}, {0.05, 0, 0}), 40, 320, 240);
}

const splat::DrawItem* find(const DrawList& list, const points::Mosaic& m) {
  for (const auto& item : list.items)
    if (item.level.x == m.level(0).x) return &item;
  return nullptr;
}

TEST(ViewSelection, ChoosesTheClosestPixelRangeAndItsSize) {
  const points::PointModel model = sphere_model();
  SelectionOptions options;
  options.hide_ratio = 1e9f;  // no revision here
  options.transitions = false;
  options.cone_culling = false;
  options.scale = 1.3f;
  std::set<int> levels_seen;
  for (const double distance : {0.45, 0.8, 2.0, 6.0}) {
    const geometry::Camera camera = view(0.4, distance);
    DrawList list;
    splat::select_view(model, camera, options, list);
    const geometry::Frustum frustum(camera);
    size_t expected_items = 0, expected_clusters = 0;
    uint64_t points = 0;
    for (const auto& [key, cluster] : model.clusters()) {
      if (!frustum.may_contain(cluster->leaf_room)) continue;
      ++expected_clusters;
      const float desired =
          points::pixel_range(camera, glm::dvec3(cluster->leaf_room.centre()), cluster->leaf_room.size().x);
      for (const points::Mosaic& m : cluster->mosaics) {
        const auto mismatch = [&](int l) { return std::abs(std::log2(m.pixel_range() / float(1 << l) / desired)); };
        int best = 0;
        for (int l = 1; l < points::kLevels; ++l)
          if (mismatch(l) < mismatch(best)) best = l;
        const splat::DrawItem* item = find(list, m);
        ASSERT_TRUE(item);
        ++expected_items;
        EXPECT_EQ(item->cluster, cluster.get());
        EXPECT_EQ(item->level.count, m.count(best));
        EXPECT_EQ(item->level.colour, m.level(best).colour);
        const float size = options.scale * desired / (m.pixel_range() / float(1 << best));
        EXPECT_NEAR(item->splat_px, std::clamp(size, 1.0f, options.max_splat_px), 1e-4f * size);
        points += m.count(best);
        levels_seen.insert(best);
      }
    }
    EXPECT_EQ(list.items.size(), expected_items);
    EXPECT_EQ(list.clusters_seen.size(), expected_clusters);
    EXPECT_EQ(list.points, points);
    EXPECT_GT(expected_items, 0u);
  }
  EXPECT_EQ(levels_seen.size(), size_t(points::kLevels)) << "the test must reach every level";
}

TEST(ViewSelection, ClustersOutsideTheFrustumAreLeftOut) {
  const points::PointModel model = sphere_model();
  DrawList list;
  splat::select_view(model, geometry::make_camera(geometry::look_at({0, 0, 2}, {0, 0, 4}), 60, 320, 240), {}, list);
  EXPECT_TRUE(list.items.empty());
  EXPECT_TRUE(list.clusters_seen.empty());
  EXPECT_EQ(list.points, 0u);
}

TEST(ViewSelection, CulledMosaicsHaveOnlyNormalsThatFaceAway) {
  const points::PointModel model = sphere_model();
  size_t culled = 0, all = 0;
  for (int step = 0; step < 16; ++step) {
    const geometry::Camera camera = view(step * 0.4, 1.1);
    const glm::vec3 eye(camera.pose.position_room);
    DrawList list;
    splat::select_view(model, camera, {}, list);
    for (const auto& [key, cluster] : model.clusters())
      for (const points::Mosaic& m : cluster->mosaics) {
        ++all;
        const bool away = splat::faces_away(m, cluster->leaf_room, eye);
        if (away) {
          EXPECT_FALSE(find(list, m)) << "drawn though it faces away";
        }
        if (!away) continue;
        ++culled;
        const points::Mosaic::Level level = m.level(0);
        for (uint32_t i = 0; i < level.count; ++i) {
          const glm::vec3 q(level.x[i], level.y[i], level.z[i]);
          const glm::vec3 p = cluster->leaf_room.lo + (q + 0.5f) / 65536.0f * cluster->leaf_room.size();
          const float cosine = glm::dot(image::decode_normal16(level.normal[i]), glm::normalize(eye - p));
          EXPECT_LT(cosine, -0.17f) << "a margin of 10 degrees is promised";
        }
      }
  }
  EXPECT_GT(culled, all / 10) << "a sphere turns nearly half of itself away";
}

// T4.4.3 on one cluster: one mosaic of each rate, each covering `pixels` of a frame at its distance.
struct Revised {
  float coarse, fine;
};
Revised revise(int coarse_pixels, int fine_pixels, const SelectionOptions& options) {
  points::PointModel model({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 0});
  const auto insert = [&](uint64_t sequence, double distance, int pixels) {
    const geometry::Camera camera = geometry::make_camera(geometry::look_at({0, 0, distance}, {0, 0, 0}), 60, 128, 128);
    image::DepthImage image(128, 128);
    for (int y = 0; y < pixels; ++y)
      for (int x = 0; x < pixels; ++x) {
        const size_t i = size_t(64 - pixels / 2 + y) * 128 + 64 - pixels / 2 + x;
        image.depth[i] = image::encode_depth(distance, camera.near_m);
        image.normal[i] = image::encode_normal16({0, 0, 1});
      }
    model.insert(points::prepare_patch(model.config(), Sequence{sequence}, camera, {0, 0, 128, 128}, image));
  };
  insert(1, 4.0, coarse_pixels);
  insert(2, 1.0, fine_pixels);
  DrawList list;
  splat::select_view(model, geometry::make_camera(geometry::look_at({0, 0, 1.0}, {0, 0, 0}), 60, 128, 128), options,
                     list);
  EXPECT_EQ(list.items.size(), 2u);
  return {list.items.at(0).splat_px, list.items.at(1).splat_px};
}

TEST(ViewSelection, LowRateMosaicsThatWouldHideHighRateOnesShrink) {
  SelectionOptions off;
  off.hide_ratio = 1e9f;
  const Revised plain = revise(10, 64, off);
  EXPECT_NEAR(plain.coarse, 4.0f, 0.05f);
  EXPECT_NEAR(plain.fine, 1.0f, 0.05f);
  const SelectionOptions options;
  const Revised revised = revise(10, 64, options);  // 10 pixels at 4 m show as much as 40 at 1 m
  EXPECT_NEAR(revised.fine, plain.fine, 1e-5f);
  EXPECT_NEAR(revised.coarse, plain.fine + options.hide_epsilon * plain.coarse, 1e-4f);
}

TEST(ViewSelection, AHandfulOfHighRatePointsDoesNotTearHoles) {
  const Revised revised = revise(10, 4, {});
  EXPECT_NEAR(revised.coarse, 4.0f, 0.05f);
}

TEST(ViewSelection, LessDetailMeansFewerAndLargerPoints) {
  const points::PointModel model = sphere_model();
  DrawList full, half;
  SelectionOptions options;
  options.hide_ratio = 1e9f;
  splat::select_view(model, view(0.3, 3.0), options, full);
  options.detail = 0.5f;
  splat::select_view(model, view(0.3, 3.0), options, half);
  EXPECT_LT(half.points, full.points * 4 / 5);
  const auto mean_px = [](const DrawList& list) {
    double sum = 0;
    for (const auto& item : list.items) sum += double(item.splat_px) * item.level.count;
    return sum / double(list.points);
  };
  EXPECT_GT(mean_px(half), mean_px(full) * 1.2);
}

// Surfaces far away are drawn by bricks, and as completely as by clusters.
TEST(ViewSelection, WhatIsFarAwayCostsItsBlocks) {
  points::PointModel model({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 5, true});
  for (int i = 0; i < 9; ++i) {
    const geometry::Camera camera = view(0.7 * i, 1.2);
    model.insert(points::prepare_patch(model.config(), Sequence{uint64_t(i) + 1}, camera, {0, 0, 320, 240},
                                       sphere_image(camera, 0, 1)));
  }
  const geometry::Camera far = view(0.3, 5.0);
  DrawList plain, first, with;
  splat::select_view(model, far, {}, plain);
  points::Summaries summaries;
  splat::select_view(model, far, {}, first, &summaries);
  EXPECT_EQ(first.items.size(), plain.items.size()) << "there are none yet";
  ASSERT_GT(first.summaries_wanted.size(), 20u);
  for (const points::ClusterKey key : first.summaries_wanted)
    summaries[key] = points::summarise(model, key, *model.bricks().at(key), Sequence{9});
  splat::select_view(model, far, {}, with, &summaries);
  EXPECT_TRUE(with.summaries_wanted.empty());
  EXPECT_LE(with.items.size(), 2 * summaries.size());
  EXPECT_GT(plain.items.size(), 4 * with.items.size());
  const std::set<points::ClusterKey> seen(with.clusters_seen.begin(), with.clusters_seen.end());
  for (const points::ClusterKey key : plain.clusters_seen) EXPECT_TRUE(seen.contains(key));

  const auto draw = [&](const DrawList& list) {
    std::vector<uint32_t> colour(size_t(far.width) * far.height);
    std::vector<float> depth(colour.size());
    splat::CpuSplatter(1).render(list, far, splat::Kernel::kDisc, image::Shading(image::ShadingParameters{}, far),
                                 {far.width, far.height, colour.data(), depth.data()});
    return std::count_if(depth.begin(), depth.end(), [](float d) { return std::isfinite(d); });
  };
  const auto covered = draw(plain);
  EXPECT_GT(covered, 300);
  EXPECT_NEAR(double(draw(with)), double(covered), 0.1 * double(covered));

  // Points that came since are drawn beside the summary; forgotten points make it useless.
  const geometry::Camera near = view(2.0, 1.0);
  model.insert(points::prepare_patch(model.config(), Sequence{10}, near, {0, 0, 320, 240}, sphere_image(near, 0, 1)));
  DrawList later;
  splat::select_view(model, far, {}, later, &summaries);
  EXPECT_GT(later.points, with.points);
  model.forget(std::vector<points::ClusterKey>{plain.clusters_seen.front()});
  splat::select_view(model, far, {}, later, &summaries);
  const points::ClusterKey brick = points::brick_key(plain.clusters_seen.front());
  EXPECT_TRUE(std::find(later.summaries_wanted.begin(), later.summaries_wanted.end(), brick) !=
              later.summaries_wanted.end());
  for (const auto& item : later.items) EXPECT_NE(item.cluster->key, brick | points::kSummaryKey);

  // A brick that was gone and came back is not taken for the one that was summarised.
  model.forget(plain.clusters_seen);
  model.insert(points::prepare_patch(model.config(), Sequence{11}, near, {0, 0, 320, 240}, sphere_image(near, 0, 8)));
  splat::select_view(model, far, {}, later, &summaries);
  EXPECT_FALSE(later.items.empty());
  std::set<points::ClusterKey> there;
  for (const auto& [key, cluster] : model.clusters()) there.insert(key);
  for (const auto& item : later.items) EXPECT_TRUE(there.contains(item.cluster->key));
}

// Points that face away are left out one by one, and only those.
TEST(ViewSelection, PointsThatFaceAwayAreNotDrawn) {
  points::PointModel model({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 0, true});  // one cluster, all directions
  for (int i = 0; i < 9; ++i) {
    const geometry::Camera camera = view(0.7 * i, 1.2);
    model.insert(points::prepare_patch(model.config(), Sequence{uint64_t(i) + 1}, camera, {0, 0, 320, 240},
                                       sphere_image(camera, 0, 1)));
  }
  const geometry::Camera camera = view(0.3, 6.0);
  for (const splat::Kernel kernel : {splat::Kernel::kDisc, splat::Kernel::kEllipse}) {
    const auto drawn = [&](bool cull) {
      SelectionOptions options;
      options.cone_culling = cull;
      options.detail = 1;
      DrawList list;
      splat::select_view(model, camera, options, list);
      std::vector<uint32_t> colour(size_t(camera.width) * camera.height);
      const auto stats =
          splat::CpuSplatter(1).render(list, camera, kernel, image::Shading(image::ShadingParameters{}, camera),
                                       {camera.width, camera.height, colour.data(), nullptr});
      return std::pair(double(stats.points_drawn) / double(list.points), colour);
    };
    const auto [all, plain] = drawn(false);
    const auto [facing, culled] = drawn(true);
    EXPECT_GT(all, 0.99);
    EXPECT_LT(facing, 0.8);
    EXPECT_GT(facing, 0.4);
    // The points left out were hidden, except where pin-holes of the front let the back shine through.
    size_t covered = 0, differs = 0;
    for (size_t i = 0; i < plain.size(); ++i) {
      covered += plain[i] != plain[0];
      differs += plain[i] != culled[i];
    }
    EXPECT_GT(covered, 500u);
    EXPECT_LT(differs * 20, covered) << differs << " of " << covered << " pixels";
  }
}

// Points of a rest, as finer rays add them, are drawn only if the options ask for rests.
TEST(Selection, PointsOfARestAreChosenOnlyWhereTheyAreAskedFor) {
  points::PointModel model = sphere_model();
  const geometry::Camera camera = view(0.3, 0.8);
  DrawList before, moving, refined;
  splat::select_view(model, camera, {}, before);
  geometry::Camera fine = camera;
  fine.width *= 2, fine.height *= 2;
  model.insert(points::prepare_patch(model.config(), Sequence{10}, fine, {0, 0, fine.width, fine.height},
                                     sphere_image(fine, 0, 1), points::tagged({10}, false, 1)));
  splat::select_view(model, camera, {}, moving);
  EXPECT_EQ(moving.points, before.points);
  EXPECT_EQ(splat::names_of(moving), splat::names_of(before)) << "its picture need not be drawn again";
  splat::select_view(model, camera, {.rests = true}, refined);
  EXPECT_GT(refined.points, moving.points + 1000);
  EXPECT_NE(splat::names_of(refined), splat::names_of(before));
}

TEST(Selection, OneListShowsEachEyeWhatItsOwnWould) {
  const points::PointModel model = sphere_model();
  for (const auto& [angle, distance] : {std::pair{0.3, 0.45}, {1.7, 0.7}, {4.0, 1.4}}) {
    const geometry::Camera head = view(angle, distance);
    const auto eyes = geometry::eye_cameras(head, 0.064, 0.6);
    SelectionOptions options;
    options.eyes = eyes;
    DrawList both;
    splat::select_view(model, head, options, both);
    const image::Shading shading = testing::unlit(head);
    const auto width = size_t(head.width);
    std::vector<uint32_t> beside(2 * width * size_t(head.height));
    splat::CpuSplatter(2).render_pair(both, eyes, {splat::Kernel::kDisc, {false, false, false}}, shading,
                                      {splat::FrameTarget{head.width, head.height, beside.data(), nullptr, 2 * width},
                                       {head.width, head.height, beside.data() + width, nullptr, 2 * width}});
    for (size_t i = 0; i < 2; ++i) {
      DrawList own;
      splat::select_view(model, eyes[i], {}, own);
      EXPECT_GT(own.points, 100u);
      EXPECT_GE(both.points, own.points);
      testing::Frame frame(head.width, head.height);
      splat::CpuSplatter(2).render(own, eyes[i], splat::Kernel::kDisc, shading, frame.target());
      size_t differ = 0, covered = 0;
      for (int y = 0; y < head.height; ++y)
        for (int x = 0; x < head.width; ++x) {
          const uint32_t shown = beside[size_t(y) * 2 * width + i * width + size_t(x)];
          differ += shown != frame.at(x, y);
          covered += frame.at(x, y) != 0xff010203u;
        }
      EXPECT_GT(covered, 1000u);
      EXPECT_LE(differ, covered / 200) << "eye " << i << " at " << distance;  // sizes at a rounding's edge
    }
  }
}

}  // namespace
}  // namespace telesplat
