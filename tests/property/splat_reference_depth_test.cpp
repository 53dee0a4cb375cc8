// The reference depth map against every point projected in double precision, and the rest that elimination keeps.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "common/geometry/trajectory.h"
#include "common/splat/facing.h"
#include "common/splat/reference/reference_depth.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/splat_kernels.h"
#include "tests/support/splat_scene.h"

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
    // A point within 0.01 pixel of a border may fall on either side: the right depth lies between these two.
    std::vector<double> nearest(pixels, INFINITY), farthest(pixels, INFINITY);
    for (const auto& [key, cluster] : model.clusters())
      for (const points::Mosaic& m : cluster->mosaics) {
        if (splat::faces_away(m, cluster->leaf_room, eye)) continue;
        const points::Mosaic::Level level = m.level(0);
        const glm::vec3 facing = splat::facing_vector(splat::leaf_view(cluster->leaf_room, eye));
        for (uint32_t i = 0; i < level.count; ++i) {
          // Points that face away are not seen; at the border rounding decides.
          const glm::dvec3 n(image::octahedral16(level.normal[i]));
          const double away = -glm::dot(n, glm::dvec3(facing)) / glm::length(n);
          if (away > 1 + 1e-4) continue;
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
              if (sure && away < 1 - 1e-4) farthest[at] = std::min(farthest[at], w);
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
        // The last bits hold the point's place in its pixel.
        wrong += !(depth[i] >= nearest[i] * (1 - 4e-5) && (depth[i] <= farthest[i] * (1 + 4e-5)));
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
  // The same frame twice, whole and by tiles, brings no new points.
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

// Points of one plane that faces the camera, at random places of some pixels: a kept sample lies farther from all of
// them than `nearest`, a dropped one does not.
TEST(Elimination, DropsWhatHasAPointOfItsSurfaceNearby) {
  const geometry::Camera camera = camera_at(0.0, 64, 48);
  const geometry::Rect whole{0, 0, 64, 48};
  const glm::vec3 towards(camera.pose.orientation * glm::dvec3(0, 0, 1));
  std::mt19937 rng(7);
  constexpr double kDepth = 0.8;
  constexpr float kNearest = 0.7f;
  struct Place {
    float x, y;
  };
  std::vector<Place> places;
  std::vector<float> reference(64 * 48, std::numeric_limits<float>::infinity());
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      if (rng() % 3 != 0) continue;
      const uint32_t sub = rng() & splat::kReferencePlaceMask;
      // One in four belongs to another surface, farther away, and must not count for this one.
      const bool other = rng() % 4 == 0;
      const float depth = float(other ? 1.1 * kDepth : kDepth);
      reference[size_t(y) * 64 + x] =
          std::bit_cast<float>((std::bit_cast<uint32_t>(depth) & ~splat::kReferencePlaceMask) | sub);
      if (!other)
        places.push_back({float(x) + (float(sub & 15) + 0.5f) / 16, float(y) + (float(sub >> 4) + 0.5f) / 16});
    }
  image::DepthImage image(64, 48);
  std::fill(image.depth.begin(), image.depth.end(), image::encode_depth(kDepth, camera.near_m));
  std::fill(image.normal.begin(), image.normal.end(), image::encode_normal16(towards));
  const auto result = splat::eliminate_redundancy(camera, whole, reference, 0.005f, image, kNearest);
  uint64_t kept = 0, wrong = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      bool own = false;
      float nearest = 100;
      for (const Place& p : places) {
        own |= int(p.x) == x && int(p.y) == y;
        nearest = std::min(nearest, std::hypot(p.x - (x + 0.5f), p.y - (y + 0.5f)));
      }
      const bool keeps = image.depth[size_t(y) * 64 + x] != 0;
      kept += keeps;
      wrong += keeps == (own || nearest <= kNearest);
    }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(result.kept, kept);
  EXPECT_GT(kept, 300u);
  EXPECT_LT(kept, 64u * 48 * 3 / 4);
}

// Views of one surface from all sides: the number of points is bounded.
TEST(Elimination, PointsOfASurfaceAreBounded) {
  points::PointModel model({{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, 4, true});
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  uint64_t last = 0, sampled = 0;
  for (int view = 0; view < 60; ++view) {
    // A plane, y = 0, seen from above at about the same distance.
    const geometry::Camera camera = geometry::make_camera(
        geometry::look_at({0.2 * uniform(rng), 1.0, 0.2 * uniform(rng)}, {0.02 * uniform(rng), 0, 0}), 50, 160, 120);
    image::DepthImage image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const glm::dvec3 at = camera.unproject(x + 0.5, y + 0.5, 1.0), ray = at - camera.pose.position_room;
        const double t = -camera.pose.position_room.y / ray.y;
        const glm::dvec3 hit = camera.pose.position_room + t * ray;
        if (std::abs(hit.x) > 0.25 || std::abs(hit.z) > 0.25) continue;
        const size_t i = size_t(y) * camera.width + x;
        image.depth[i] = image::encode_depth(t, camera.near_m);
        image.normal[i] = image::encode_normal16({0, 1, 0});
      }
    std::vector<float> depth;
    splat::render_reference_depth(model, camera, 1, depth);
    const geometry::Rect whole{0, 0, camera.width, camera.height};
    const auto result = splat::eliminate_redundancy(camera, whole, depth, 0.005f, image);
    sampled = result.samples, last = result.kept;
    model.insert(points::prepare_patch(model.config(), Sequence{uint64_t(view) + 1}, camera, whole, image));
  }
  EXPECT_LT(last, sampled / 30) << "a view adds next to nothing in the end";
  EXPECT_LT(static_cast<double>(model.points()),
            1.1547 / (splat::kNearestSample * splat::kNearestSample) * static_cast<double>(sampled));
  EXPECT_GT(model.points(), sampled);
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
  const auto result = splat::eliminate_redundancy(camera, tile, reference, kEpsilon, image, 0);
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

TEST(ReferenceDepth, WithAPatchIsThatOfTheModelThatTookIt) {
  points::PointModel model = bumpy_model();
  const geometry::Camera camera = camera_at(0.4, 301, 260), from = camera_at(0.9);
  std::vector<float> with, before;
  splat::render_reference_depth(model, camera, 1, with);
  before = with;
  for (uint32_t i = 6; i < 9; ++i) {
    auto patch = points::prepare_patch(model.config(), Sequence{i}, from, {10 * int(i), 20, 200, 150}, [&] {
      const image::DepthImage all = bumpy_image(from, i);
      image::DepthImage part(200, 150);
      for (int y = 0; y < 150; ++y)
        for (int x = 0; x < 200; ++x) {
          const size_t to = size_t(y) * 200 + x, at = size_t(20 + y) * from.width + 10 * i + x;
          part.depth[to] = all.depth[at], part.colour[to] = all.colour[at], part.normal[to] = all.normal[at];
        }
      return part;
    }());
    splat::add_to_reference_depth(patch, model.config(), camera, with);
    model.insert(std::move(patch));
  }
  std::vector<float> expected;
  splat::render_reference_depth(model, camera, 1, expected);
  EXPECT_TRUE(with == expected);
  EXPECT_FALSE(before == expected);
}

TEST(EliminateRedundancy, WhereFewWereCastLeavesTheSame) {
  const points::PointModel model = bumpy_model();
  const geometry::Camera camera = camera_at(0.4, 301, 260);
  std::vector<float> reference_m;
  splat::render_reference_depth(model, camera, 1, reference_m);
  std::mt19937 rng(3);
  uint64_t kept = 0, samples = 0;
  for (const geometry::Rect& tile : {geometry::Rect{0, 0, 128, 100}, {173, 100, 128, 160}}) {
    const image::DepthImage all = bumpy_image(camera, 8);
    image::DepthImage came(tile.width, tile.height);
    image::PixelMask cast(tile.width, tile.height);
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        if (rng() % 9 != 0) continue;
        cast.set(x, y);
        const size_t to = size_t(y) * tile.width + x, at = size_t(tile.y + y) * camera.width + tile.x + x;
        came.depth[to] = all.depth[at], came.colour[to] = all.colour[at], came.normal[to] = all.normal[at];
      }
    image::DepthImage expected = came;
    const auto whole = splat::eliminate_redundancy(camera, tile, reference_m, 0.005f, expected);
    const auto some = splat::eliminate_where_cast(camera, tile, {cast, reference_m}, 0.005f, came);
    EXPECT_TRUE(came == expected);
    EXPECT_EQ(some.samples, whole.samples);
    EXPECT_EQ(some.kept, whole.kept);
    kept += some.kept, samples += some.samples;
  }
  EXPECT_GT(kept, 100u);
  EXPECT_LT(kept, samples - 100);
}

}  // namespace
}  // namespace telesplat
