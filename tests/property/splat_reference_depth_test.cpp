// The reference depth map against projecting every point in double precision, and what redundancy elimination leaves.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "common/geometry/trajectory.h"
#include "common/splat/reference_depth.h"
#include "common/splat/view_selection.h"
#include "tests/unit/splat_scene.h"

namespace telesplat {
namespace {

geometry::Camera camera_at(double angle, int width = 333, int height = 211) {
  return geometry::make_camera(geometry::look_at({0.9 * std::sin(angle), 0.5, 0.9 * std::cos(angle)}, {0, 0, 0}), 70,
                               width, height);
}

// A bumpy slab seen by the camera; odd seeds leave holes.
image::DepthImage bumpy_image(const geometry::Camera& camera, uint32_t seed) {
  std::mt19937 rng(seed);
  image::DepthImage out(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (seed % 2 == 1 && rng() % 3 == 0) continue;
      const double depth = 0.8 + 0.1 * std::sin(0.05 * x + seed) * std::cos(0.07 * y);
      const size_t i = size_t(y) * camera.width + x;
      out.depth[i] = image::encode_depth(depth, camera.near_m);
      out.colour[i] = rng() & 0xffffff;
      out.normal[i] =
          image::encode_normal16(glm::vec3(camera.pose.orientation * glm::dvec3(0.3 * std::cos(0.05 * x), 0.2, 1)));
    }
  return out;
}

points::PointModel bumpy_model() {
  points::PointModel model({{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, 5});
  for (uint32_t i = 0; i < 5; ++i) {
    const geometry::Camera camera = camera_at(1.3 * i);
    model.insert(points::prepare_patch(model.config(), Sequence{i + 1}, camera, {0, 0, camera.width, camera.height},
                                       bumpy_image(camera, i)));
  }
  return model;
}

TEST(ReferenceDepth, EqualsProjectingEveryPointInDoublePrecision) {
  const points::PointModel model = bumpy_model();
  for (const double angle : {0.0, 0.7, 2.9}) {
    const geometry::Camera camera = camera_at(angle, 301, 260);
    const glm::vec3 eye(camera.pose.position_room);
    const auto t = camera.room_to_pixel();
    const size_t pixels = size_t(camera.width) * camera.height;
    // A point within 0.01 pixel of a border may fall on either side: expected lies between these two.
    std::vector<double> nearest(pixels, INFINITY), farthest(pixels, INFINITY);
    for (const auto& [key, cluster] : model.clusters())
      for (const points::Mosaic& m : cluster->mosaics) {
        if (splat::faces_away(m, cluster->leaf_room, eye)) continue;
        const points::Mosaic::Level level = m.level(0);
        for (uint32_t i = 0; i < level.count; ++i) {
          const glm::dvec3 q(level.x[i], level.y[i], level.z[i]);
          const glm::dvec4 p(
              glm::dvec3(cluster->leaf_room.lo) + (q + 0.5) / 65536.0 * glm::dvec3(cluster->leaf_room.size()), 1.0);
          const double w = glm::dot(t.w, p), x = glm::dot(t.x, p) / w, y = glm::dot(t.y, p) / w;
          if (w < camera.near_m) continue;
          for (const double dx : {-0.01, 0.0, 0.01})
            for (const double dy : {-0.01, 0.0, 0.01}) {
              const double px = std::floor(x + dx), py = std::floor(y + dy);
              if (px < 0 || py < 0 || px >= camera.width || py >= camera.height) continue;
              const size_t at = size_t(py) * camera.width + size_t(px);
              nearest[at] = std::min(nearest[at], w);
              const bool sure =
                  std::floor(x - 0.01) == std::floor(x + 0.01) && std::floor(y - 0.01) == std::floor(y + 0.01);
              if (sure) farthest[at] = std::min(farthest[at], w);
            }
        }
      }
    for (int threads : {1, 2, 5}) {
      std::vector<float> depth;
      splat::render_reference_depth(model, camera, threads, depth);
      ASSERT_EQ(depth.size(), pixels);
      size_t wrong = 0, covered = 0;
      for (size_t i = 0; i < pixels; ++i) {
        covered += std::isfinite(depth[i]);
        wrong += !(depth[i] >= nearest[i] * (1 - 1e-5) && (depth[i] <= farthest[i] * (1 + 1e-5)));
      }
      EXPECT_EQ(wrong, 0u) << threads << " threads, of " << pixels << " pixels";
      EXPECT_GT(covered, pixels / 4);
    }
  }
}

TEST(ReferenceDepth, NothingIsInfinitelyFar) {
  const points::PointModel model({{{-1, -1, -1}, {1, 1, 1}}, 5});
  std::vector<float> depth(7, 1.0f);
  splat::render_reference_depth(model, camera_at(0), 2, depth);
  ASSERT_EQ(depth.size(), size_t{333} * 211);
  for (float d : depth) ASSERT_EQ(d, std::numeric_limits<float>::infinity());
}

TEST(Elimination, WhatTheModelShowsIsNotSentAgain) {
  // The same frame twice, whole and by tiles: nothing new.
  points::PointModel model({{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, 6});
  const geometry::Camera camera = camera_at(0.4);
  const image::DepthImage image = bumpy_image(camera, 2);
  model.insert(points::prepare_patch(model.config(), Sequence{1}, camera, {0, 0, camera.width, camera.height}, image));
  std::vector<float> depth;
  splat::render_reference_depth(model, camera, 2, depth);
  image::DepthImage again = image;
  const auto result = splat::eliminate_redundancy(camera, {0, 0, camera.width, camera.height}, depth, 0.002f, again);
  EXPECT_EQ(result.samples, image.pixels());
  EXPECT_LT(result.kept, image.pixels() / 100) << "over 99 % are eliminated";
}

TEST(Elimination, KeepsWhatIsNearerByMoreThanEpsilonInCanonicalForm) {
  const geometry::Camera camera = camera_at(0.0, 64, 48);
  const geometry::Rect tile{16, 8, 37, 21};
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  std::vector<float> reference(64 * 48);
  for (float& d : reference)
    d = rng() % 5 == 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(uniform(rng));
  image::DepthImage image(tile.width, tile.height);
  for (size_t i = 0; i < image.pixels(); ++i) {
    if (rng() % 4 == 0) continue;
    image.depth[i] = image::encode_depth(uniform(rng), camera.near_m);
    image.colour[i] = rng() & 0xffffff;
    image.normal[i] = static_cast<uint16_t>(rng());
  }
  const image::DepthImage before = image;
  constexpr float kEpsilon = 0.01f;
  const auto result = splat::eliminate_redundancy(camera, tile, reference, kEpsilon, image);
  uint64_t samples = 0, kept = 0;
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; ++x) {
      const size_t i = size_t(y) * tile.width + x;
      const double shown = reference[size_t(tile.y + y) * 64 + tile.x + x];
      samples += before.depth[i] != 0;
      kept += image.depth[i] != 0;
      if (image.depth[i] != 0) {
        EXPECT_EQ(image.depth[i], before.depth[i]);
        EXPECT_EQ(image.colour[i], before.colour[i]);
        EXPECT_EQ(image.normal[i], before.normal[i]);
      } else {
        EXPECT_EQ(image.colour[i], 0u);
        EXPECT_EQ(image.normal[i], 0u);
      }
      if (before.depth[i] == 0) {
        EXPECT_EQ(image.depth[i], 0u);
        continue;
      }
      const double depth = image::decode_depth(before.depth[i], camera.near_m);
      if (depth * (1 + kEpsilon) < shown * (1 - 1e-6)) {
        EXPECT_NE(image.depth[i], 0u) << depth << " before " << shown;
      }
      if (depth * (1 + kEpsilon) > shown * (1 + 1e-6)) {
        EXPECT_EQ(image.depth[i], 0u) << depth << " before " << shown;
      }
    }
  EXPECT_EQ(result.samples, samples);
  EXPECT_EQ(result.kept, kept);
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, samples);
}

}  // namespace
}  // namespace telesplat
