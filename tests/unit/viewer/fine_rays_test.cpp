// What finer rays of a view have met: kept for its eye alone, looked up for any picture of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/viewer/points/patch_rays.h"
#include "common/codec/mask_stream.h"

namespace telesplat::viewer {
namespace {

constexpr EpochId kEpoch{3};
constexpr float kInf = std::numeric_limits<float>::infinity();
const geometry::Camera kView = geometry::make_camera({}, 90, 320, 200);

geometry::Camera finer(int times) {
  geometry::Camera c = kView;
  c.width *= times, c.height *= times;
  return c;
}

// A tile in which some rays met nothing, and some something two metres away.
struct Sampled {
  Sampled(int times, const geometry::Rect& r) : camera(finer(times)), rect(r), missed(r.width, r.height) {
    image = image::DepthImage(r.width, r.height);
  }
  Sampled& miss(int x, int y) { return missed.set(x - rect.x, y - rect.y), *this; }
  Sampled& hit(int x, int y, double depth_m = 2) {
    image.depth[size_t((y - rect.y) * rect.width + x - rect.x)] = image::encode_depth(depth_m, camera.near_m);
    return *this;
  }
  FineRays::Tile tile(EpochId epoch = kEpoch) const { return {epoch, camera, rect, &missed, rect, &image}; }

  geometry::Camera camera;
  geometry::Rect rect;
  image::PixelMask missed;
  image::DepthImage image;
};

float at(const FineRays& rays, const geometry::Camera& camera, int x, int y, EpochId epoch = kEpoch) {
  std::vector<float> met_m;
  if (!rays.look_up(camera, epoch, met_m)) return 0;
  EXPECT_EQ(met_m.size(), size_t(camera.width) * size_t(camera.height));
  return met_m[size_t(y) * size_t(camera.width) + size_t(x)];
}

TEST(FineRays, TellWhatEachRayMet) {
  FineRays rays;
  EXPECT_EQ(at(rays, finer(4), 5, 5), 0);
  rays.add(Sampled(4, {600, 300, 100, 90}).miss(600, 300).hit(601, 300).hit(699, 389, 7.5).tile());
  EXPECT_EQ(at(rays, finer(4), 600, 300), kInf);
  EXPECT_NEAR(at(rays, finer(4), 601, 300), 2, 1e-3);
  EXPECT_NEAR(at(rays, finer(4), 699, 389), 7.5, 4e-3);
  EXPECT_EQ(at(rays, finer(4), 602, 300), 0) << "nobody looked there";
  EXPECT_EQ(at(rays, finer(4), 600, 300, {4}), 0) << "another epoch";
  const geometry::Camera part = geometry::crop(finer(4), {590, 290, 40, 20});
  EXPECT_EQ(at(rays, part, 10, 10), kInf);
  EXPECT_NEAR(at(rays, part, 11, 10), 2, 1e-3);
  // A picture with other pixels shows the ray nearest to each.
  geometry::Camera other = finer(4);
  other.width = 1000, other.height = 625;
  EXPECT_EQ(at(rays, other, 469, 234), kInf) << "at 600.96, 300.16 of the rays";
  rays.clear();
  EXPECT_EQ(at(rays, finer(4), 600, 300), 0);
}

TEST(FineRays, TheFinestOnesCount) {
  FineRays rays;
  rays.add(Sampled(2, {300, 150, 20, 20}).miss(300, 150).miss(302, 150).tile());
  EXPECT_EQ(at(rays, finer(4), 600, 300), kInf) << "there are no finer ones yet";
  rays.add(Sampled(4, {600, 300, 40, 40}).hit(600, 300).tile());
  rays.add(Sampled(2, {310, 160, 20, 20}).miss(310, 160).tile());
  EXPECT_NEAR(at(rays, finer(4), 600, 300), 2, 1e-3);
  for (const auto& [x, y] : {std::pair{601, 300}, {600, 301}, {601, 301}, {604, 300}, {620, 320}})
    EXPECT_EQ(at(rays, finer(4), x, y), -kInf) << "one of twice the resolution was there at " << x << ", " << y;
}

TEST(FineRays, AreOfOneEye) {
  FineRays rays;
  rays.add(Sampled(4, {600, 300, 40, 40}).miss(600, 300).hit(640 - 1, 300).tile());
  geometry::Camera beside = finer(4);
  beside.pose.position_room.x += 1e-3;  // moves what is 2 m away by 0.3 pixels
  EXPECT_EQ(at(rays, beside, 600, 300), kInf);
  beside.pose.position_room.x += 2e-3;
  EXPECT_EQ(at(rays, beside, 600, 300), 0);

  // The same eye looks elsewhere: what lies in another direction has another depth.
  geometry::Camera turned =
      geometry::make_camera({{0, 0, 0}, glm::angleAxis(0.3, glm::dvec3(0, 1, 0))}, 100, 1280, 800);
  std::vector<float> met_m;
  ASSERT_TRUE(rays.look_up(turned, kEpoch, met_m));
  const glm::dvec3 hit = finer(4).unproject(639.5, 300.5, 2);
  const auto t = turned.room_to_pixel();
  const double w = glm::dot(t.w, glm::dvec4(hit, 1));
  const int x = int(glm::dot(t.x, glm::dvec4(hit, 1)) / w), y = int(glm::dot(t.y, glm::dvec4(hit, 1)) / w);
  float nearest = 0;
  for (int j = y - 1; j <= y + 1; ++j)
    for (int i = x - 1; i <= x + 1; ++i) nearest = std::max(nearest, met_m[size_t(j) * 1280 + size_t(i)]);
  EXPECT_NEAR(nearest, w, 2e-3 * w);
  EXPECT_GT(std::abs(w - 2), 0.05);
  turned.pose.orientation = glm::angleAxis(3.1, glm::dvec3(0, 1, 0));
  EXPECT_FALSE(rays.look_up(turned, kEpoch, met_m)) << "it looks away";

  // A view from elsewhere begins anew.
  Sampled next(4, {0, 0, 8, 8});
  next.camera.pose.position_room.z += 0.5;
  rays.add(next.miss(1, 1).tile());
  EXPECT_EQ(at(rays, finer(4), 600, 300), 0);
  EXPECT_EQ(at(rays, next.camera, 1, 1), kInf);
  // So does an epoch.
  Sampled later(4, {0, 0, 8, 8});
  later.camera = next.camera;
  rays.add(later.miss(2, 2).tile({9}));
  EXPECT_EQ(at(rays, next.camera, 1, 1, {9}), 0);
  EXPECT_EQ(at(rays, next.camera, 2, 2, {9}), kInf);
}

TEST(FineRays, WhatAViewFindsWhereTheyMetNothingIsForgotten) {
  FineRays rays;
  rays.add(Sampled(4, {600, 300, 40, 40})
               .miss(600, 300)
               .miss(603, 303)
               .miss(604, 300)
               .hit(601, 300, 5)
               .hit(602, 300)
               .tile());
  rays.add(Sampled(2, {300, 150, 40, 40}).miss(301, 151).tile());
  Sampled view(1, {140, 70, 40, 40});
  view.hit(150, 75, 2);  // 600 to 603, 300 to 303 of the finest
  rays.revise(view.camera, view.rect, view.image);
  for (const auto& [x, y] : {std::pair{600, 300}, {603, 303}, {601, 300}}) EXPECT_EQ(at(rays, finer(4), x, y), 0);
  EXPECT_NEAR(at(rays, finer(4), 602, 300), 2, 1e-3) << "they agree";
  EXPECT_EQ(at(rays, finer(4), 604, 300), kInf);
  view.camera.pose.position_room.x = 1;
  view.hit(151, 75, 2);
  rays.revise(view.camera, view.rect, view.image);
  EXPECT_EQ(at(rays, finer(4), 604, 300), kInf) << "a view from elsewhere";
}

TEST(FineRays, TakeBoundedMemory) {
  FineRays rays;
  const int side = 16384, blocks = side / FineRays::kBlock;
  geometry::Camera camera = geometry::make_camera({}, 90, side, side);
  image::PixelMask missed(side, 1);
  for (int x = 0; x < side; x += FineRays::kBlock) missed.set(x, 0);
  const image::DepthImage nothing(1, 1);
  for (int y = 0; y < side; y += FineRays::kBlock)
    rays.add({kEpoch, camera, {0, y, side, 1}, &missed, {0, y, 1, 1}, &nothing});
  const auto known = [&](int y) { return at(rays, geometry::crop(camera, {0, y, 64, 64}), 0, 0) != 0; };
  const int kept = int(FineRays::kMostBlocks) / blocks;
  EXPECT_TRUE(known(0));
  EXPECT_TRUE(known((kept - 1) * FineRays::kBlock));
  EXPECT_FALSE(known(kept * FineRays::kBlock));
}

TEST(FineRays, TellWhereSomethingChanged) {
  FineRays rays;
  std::vector<geometry::Rect> changes;
  rays.take_changes(kView, changes);
  EXPECT_TRUE(changes.empty());
  rays.add(Sampled(4, {600, 300, 40, 20}).tile());
  rays.take_changes(kView, changes);
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0], (geometry::Rect{150, 75, 10, 5}));
  changes.clear();
  rays.take_changes(kView, changes);
  EXPECT_TRUE(changes.empty());
  // Nobody takes them for long: then they are one.
  for (int i = 0; i < 10'000; ++i) rays.add(Sampled(4, {i % 100, 300, 4, 4}).tile());
  rays.take_changes(kView, changes);
  EXPECT_LT(changes.size(), 5000u);
  EXPECT_NE(std::find(changes.begin(), changes.end(), geometry::Rect{0, 0, 320, 200}), changes.end());
}

TEST(FineRays, ComeWithPatches) {
  FineRays rays;
  const Sampled s = Sampled(4, {600, 300, 40, 40}).miss(600, 300).hit(601, 300);
  wire::Patch patch;
  patch.epoch = kEpoch, patch.camera = s.camera, patch.rect = patch.missed_rect = s.rect;
  patch.extra = true;
  ASSERT_TRUE(add_rays(patch, s.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 601, 300), 0) << "from beside a view";
  patch.missed = codec::encode_mask(s.missed);
  ASSERT_TRUE(add_rays(patch, s.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 600, 300), kInf);
  EXPECT_NEAR(at(rays, finer(4), 601, 300), 2, 1e-3);
  patch.missed.assign(5, 0xffffffff);
  EXPECT_FALSE(add_rays(patch, s.image, rays).ok());

  Sampled view(1, {150, 75, 1, 1});
  patch.extra = false, patch.missed.clear(), patch.camera = view.camera, patch.rect = view.rect;
  view.hit(150, 75, 1);
  ASSERT_TRUE(add_rays(patch, view.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 600, 300), 0) << "something came";
}

}  // namespace
}  // namespace telesplat::viewer
