#include "services/packer/points/elimination/known_points.h"

#include <gtest/gtest.h>

#include <glm/gtc/quaternion.hpp>

#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

constexpr int kSide = 16;
constexpr double kDepth_m = 0.5;  // of what is sampled

// Looks along -z at the plane z = 0, moved aside by so many pixels there.
geometry::Camera camera(double x_px = 0, int side = kSide, double from = 1) {
  const double pixel_m = 2 * kDepth_m * std::tan(glm::radians(10.0)) / side;
  return geometry::make_camera(
      {{x_px * pixel_m, 0, from * kDepth_m}, from > 0 ? glm::dquat(1, 0, 0, 0) : glm::dquat(0, 0, 1, 0)}, 20, side,
      side);
}

SampledTile sampled(const geometry::Camera& camera, const glm::vec3& normal, FrameId frame = {1}) {
  SampledTile tile;
  tile.frame = frame, tile.camera = camera, tile.rect = {0, 0, camera.width, camera.height};
  tile.image = image::DepthImage(camera.width, camera.height);
  std::fill(tile.image.depth.begin(), tile.image.depth.end(), image::encode_depth(kDepth_m, camera.near_m));
  std::fill(tile.image.colour.begin(), tile.image.colour.end(), 0x808080u);
  std::fill(tile.image.normal.begin(), tile.image.normal.end(), image::encode_normal16(normal));
  return tile;
}

// One leaf has all of it.
points::PointModel model_of(const SampledTile& tile, FrameId tag = {1}) {
  points::PointModel model({{glm::vec3(-0.1f), glm::vec3(0.1f)}, 0, true});
  model.insert(points::prepare_patch(model.config(), {1}, tile.camera, tile.rect, tile.image, tag));
  return model;
}

constexpr glm::vec3 kFront{0, 0, 1}, kAway{0.1f, 0, -1};

uint64_t dropped(const points::PointModel& model, SampledTile tile, float nearest, uint32_t group = 0) {
  const uint64_t out = drop_known_points(model, nearest, group, tile);
  EXPECT_EQ(uint64_t(std::count(tile.image.depth.begin(), tile.image.depth.end(), 0u)), out);
  for (size_t i = 0; i < tile.image.pixels(); ++i)
    if (tile.image.depth[i] == 0) EXPECT_EQ(tile.image.colour[i] + tile.image.normal[i], 0u);
  return out;
}

TEST(KnownPoints, APointWithinTheFootprintMakesASampleSuperfluous) {
  const auto model = model_of(sampled(camera(), kFront));
  EXPECT_EQ(dropped(model, sampled(camera(0.3), kFront), 0.4f), uint64_t{kSide * kSide});
  EXPECT_EQ(dropped(model, sampled(camera(0.5), kFront), 0.4f), 0u);
  EXPECT_EQ(dropped(model, sampled(camera(0.5), kFront), 0.55f), uint64_t{kSide * kSide});
}

TEST(KnownPoints, APointThatFacesAwayFromTheEyeIsKnownToo) {
  const auto model = model_of(sampled(camera(), kAway));
  EXPECT_EQ(dropped(model, sampled(camera(), kAway), 0.4f), uint64_t{kSide * kSide});
}

TEST(KnownPoints, BothSidesOfASheetStay) {
  const auto model = model_of(sampled(camera(), kFront));
  EXPECT_EQ(dropped(model, sampled(camera(0, kSide, -1), -kFront), 0.4f), 0u);
}

// Twice as many pixels a side: a coarse point is near to one of four samples at most.
TEST(KnownPoints, TheFinerOfTwoFootprintsCounts) {
  const auto coarse = model_of(sampled(camera(), kFront)), fine = model_of(sampled(camera(0, 2 * kSide), kFront));
  EXPECT_EQ(dropped(coarse, sampled(camera(0, 2 * kSide), kFront), 0.6f), 0u) << "0.71 of its pixels away";
  EXPECT_EQ(dropped(coarse, sampled(camera(0, 2 * kSide), kFront), 0.8f), uint64_t{4 * kSide * kSide});
  EXPECT_EQ(dropped(fine, sampled(camera(), kFront), 0.6f), 0u) << "0.35 of its pixels, 0.71 of theirs";
  EXPECT_EQ(dropped(fine, sampled(camera(), kFront), 0.8f), uint64_t{kSide * kSide});
}

TEST(KnownPoints, PointsThatWillBeGoneCountForTheirOwnRestAlone) {
  const FrameId rest = points::tagged({}, 1, 7), coarse = points::tagged({1}, 4);
  const auto group = [](FrameId tag) { return static_cast<uint32_t>(tag.value); };
  const auto resting = model_of(sampled(camera(), kFront), rest);
  EXPECT_EQ(dropped(resting, sampled(camera(), kFront), 0.4f), 0u);
  EXPECT_EQ(dropped(resting, sampled(camera(), kFront), 0.4f, group(points::tagged({}, 1, 8))), 0u);
  EXPECT_EQ(dropped(resting, sampled(camera(), kFront), 0.4f, group(rest)), uint64_t{kSide * kSide});
  EXPECT_EQ(dropped(model_of(sampled(camera(), kFront), coarse), sampled(camera(), kFront), 0.4f), 0u);
}

// Of a scene with folds, from many eyes: as each sample beside each point tells.
TEST(KnownPoints, AreThoseThatEachPairTells) {
  std::mt19937_64 random(3);
  points::PointModel model(test::scene_config(4));
  const float nearest = 0.9f;
  uint64_t sum = 0;
  for (uint64_t i = 1; i <= 6; ++i) {
    const geometry::Camera c = test::scene_camera(test::random_eye(random), 120, 80);
    SampledTile tile;
    tile.frame = {i}, tile.camera = c, tile.rect = {10, 8, 90, 60};
    tile.image = test::sample_scene(c, tile.rect);
    points::PreparedPatch whole = points::prepare_patch(model.config(), {i}, c, tile.rect, tile.image, {i});
    const image::DepthImage before = tile.image;
    sum += drop_known_points(model, nearest, 0, tile);
    // What is left, and what went, as points.
    image::DepthImage gone = before;
    for (size_t p = 0; p < gone.pixels(); ++p)
      if (tile.image.depth[p] != 0) gone.depth[p] = gone.colour[p] = gone.normal[p] = 0;
    const double footprint = 1 / c.focal_x();
    for (const bool kept : {true, false}) {
      const auto part = points::prepare_patch(model.config(), {i}, c, tile.rect, kept ? tile.image : gone, {i});
      for (const auto& [key, samples] : part.mosaics) {
        const geometry::Box leaf = points::leaf_box(model.config(), key);
        const double unit = double(leaf.hi.x - leaf.lo.x) / 65536;
        for (uint32_t k = 0; k < samples.count(0); ++k) {
          const auto s = samples.level(0);
          const glm::dvec3 at = glm::dvec3(leaf.lo) + unit * glm::dvec3(s.x[k], s.y[k], s.z[k]);
          const double depth = glm::dot(c.room_to_pixel().w, glm::dvec4(at, 1));
          double least = 1e9;  // of its reach
          if (const points::Cluster* cluster = model.find(key))
            for (const points::Mosaic& m : cluster->mosaics)
              for (uint32_t n = 0; n < m.count(0); ++n) {
                const auto p = m.level(0);
                if (glm::dot(image::decode_normal16(s.normal[k]), image::decode_normal16(p.normal[n])) <= 0) continue;
                const double reach = nearest * std::min(depth * footprint / unit, 65536.0 / m.pixel_range());
                least = std::min(
                    least,
                    glm::length(glm::dvec3(s.x[k], s.y[k], s.z[k]) - glm::dvec3(p.x[n], p.y[n], p.z[n])) / reach);
              }
          if (kept) EXPECT_GT(least, 0.999);
          if (!kept) EXPECT_LT(least, 1.001);
        }
      }
    }
    model.insert(std::move(whole));
  }
  EXPECT_GT(sum, 1000u);
}

}  // namespace
}  // namespace telesplat::packer
