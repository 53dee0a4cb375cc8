// Results of a view's finer rays: kept for that view's eye alone, and looked up for any picture from there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/viewer/points/event_sequencer.h"
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

// A tile with rays that met no surface and rays that met one two metres away.
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

// Rays that met no surface, left of a surface 2 m away.
void add_surface(FineRays& rays) {
  Sampled fine(4, {600, 300, 80, 40});
  for (int y = 300; y < 340; ++y)
    for (int x = 600; x < 680; ++x) x < 640 ? fine.miss(x, y) : fine.hit(x, y);
  rays.add(fine.tile());
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
  // A picture with other pixels shows the ray nearest to each pixel.
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
  // Rays of a third size are not kept.
  FineRays three;
  add_surface(three);
  for (const int times : {2, 3}) three.add(Sampled(times, {0, 0, 4, 4}).miss(0, 0).tile());
  EXPECT_EQ(at(three, finer(4), 620, 320), 0);
  for (const auto& [x, y] : {std::pair{601, 300}, {600, 301}, {601, 301}, {604, 300}, {620, 320}})
    EXPECT_EQ(at(rays, finer(4), x, y), -kInf) << "one of twice the resolution was there at " << x << ", " << y;
}

TEST(FineRays, AreOfOneEye) {
  FineRays rays;
  rays.add(Sampled(4, {600, 300, 40, 40}).miss(600, 300).hit(640 - 1, 300).tile());
  geometry::Camera beside = finer(4);
  beside.pose.position_room.x += 4e-4;  // moves a surface 0.3 m away by 0.9 rays: there may be one as near
  EXPECT_EQ(at(rays, beside, 600, 300), kInf);
  beside.pose.position_room.x += 2e-4;
  EXPECT_EQ(at(rays, beside, 600, 300), 0);
  FineRays nothing_met;
  nothing_met.add(Sampled(4, {600, 300, 40, 40}).miss(600, 300).tile());
  EXPECT_EQ(at(nothing_met, finer(4), 600, 300), kInf);
  EXPECT_EQ(at(nothing_met, beside, 600, 300), 0) << "it is not known how near things are";

  // The same eye looks elsewhere: the depth of a point depends on the direction of the look.
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

  rays.follow(kView);
  EXPECT_EQ(at(rays, finer(4), 600, 300), kInf);
  FineRays moved;
  add_surface(moved);
  geometry::Camera elsewhere = kView;
  elsewhere.pose.position_room.z += 0.1;
  moved.follow(elsewhere);
  EXPECT_EQ(at(moved, finer(4), 620, 320), 0);

  // A view from another place begins anew.
  Sampled next(4, {0, 0, 8, 8});
  next.camera.pose.position_room.z += 0.5;
  rays.add(next.miss(1, 1).tile());
  EXPECT_EQ(at(rays, finer(4), 600, 300), 0);
  EXPECT_EQ(at(rays, next.camera, 1, 1), kInf);
  // So does a new epoch.
  Sampled later(4, {0, 0, 8, 8});
  later.camera = next.camera;
  rays.add(later.miss(2, 2).tile({9}));
  EXPECT_EQ(at(rays, next.camera, 1, 1, {9}), 0);
  EXPECT_EQ(at(rays, next.camera, 2, 2, {9}), kInf);
}

TEST(FineRays, WhatOthersMeetWhereTheyMetNothingIsForgotten) {
  FineRays rays;
  add_surface(rays);
  Sampled view(1, {140, 70, 40, 40});
  view.hit(155, 80, 2);  // 620 to 623, 320 to 323 of the finest rays
  rays.revise(view.camera, view.rect, view.image);
  for (const auto& [x, y] : {std::pair{620, 320}, {623, 323}, {620, 323}, {622, 322}})
    EXPECT_EQ(at(rays, finer(4), x, y), 0) << x << ", " << y;
  EXPECT_EQ(at(rays, finer(4), 610, 320), kInf);
  std::vector<geometry::Rect> changes;
  rays.take_changes(finer(4), changes);
  EXPECT_EQ(changes.size(), 2u) << "the tile, and around the ray";

  // From another place, before the surface.
  view = Sampled(1, {0, 0, 320, 200});
  view.camera.pose.position_room = {0.5, 0, 0};
  const glm::dvec3 there = finer(4).unproject(660.5, 320.5, 1);
  const auto t = view.camera.room_to_pixel();
  const double w = glm::dot(t.w, glm::dvec4(there, 1));
  view.hit(int(glm::dot(t.x, glm::dvec4(there, 1)) / w), int(glm::dot(t.y, glm::dvec4(there, 1)) / w), w);
  rays.revise(view.camera, view.rect, view.image);
  int forgotten = 0;
  for (int x = 650; x < 670; ++x) forgotten += at(rays, finer(4), x, 320) == 0;
  EXPECT_GT(forgotten, 3);
}

TEST(FineRays, WhatOthersMeetBesideASilhouetteChangesNothing) {
  FineRays rays;
  add_surface(rays);
  FineRays same;
  add_surface(same);
  Sampled rim(4, {639, 320, 1, 1});
  rays.revise(rim.camera, rim.rect, rim.hit(639, 320).image);
  EXPECT_EQ(at(rays, finer(4), 639, 320), kInf) << "the ray beside it met that surface";
  const Sampled view = Sampled(1, {140, 70, 40, 40}).hit(165, 80, 2).hit(166, 80, 2.05).hit(167, 80, 5);
  rays.revise(view.camera, view.rect, view.image);
  for (int x = 600; x < 680; ++x) EXPECT_EQ(at(rays, finer(4), x, 321), at(same, finer(4), x, 321)) << x;
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
  Sampled view(1, {0, 0, 1, 1});
  view.camera = camera;
  for (int y = 0; y < side; y += 2048) {
    view.rect.y = y;
    view.hit(0, y, 1);
    rays.revise(view.camera, view.rect, view.image);
  }
  EXPECT_FALSE(known(0)) << "something came";
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
  // If the changes are not taken for long, they become one.
  for (int i = 0; i < 10'000; ++i) rays.add(Sampled(4, {i % 100, 300, 4, 4}).tile());
  rays.take_changes(kView, changes);
  EXPECT_LT(changes.size(), 5000u);
  EXPECT_NE(std::find(changes.begin(), changes.end(), geometry::Rect{0, 0, 320, 200}), changes.end());
}

TEST(FineRays, ComeWithPatches) {
  FineRays rays;
  const Sampled s = Sampled(4, {600, 300, 40, 40}).miss(600, 300).hit(601, 300);
  wire::Patch patch;
  patch.epoch = kEpoch, patch.camera = s.camera, patch.rect = patch.missed.rect = s.rect;
  patch.extra = true;
  ASSERT_TRUE(add_rays(patch, s.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 601, 300), 0) << "from beside a view";
  patch.missed.words = codec::encode_mask(s.missed);
  ASSERT_TRUE(add_rays(patch, s.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 600, 300), kInf);
  EXPECT_NEAR(at(rays, finer(4), 601, 300), 2, 1e-3);
  patch.missed.words.assign(5, 0xffffffff);
  EXPECT_FALSE(add_rays(patch, s.image, rays).ok());

  Sampled view(4, {600, 300, 1, 1});
  patch.extra = false, patch.missed.words.clear(), patch.camera = view.camera, patch.rect = view.rect;
  view.hit(600, 300, 1);
  ASSERT_TRUE(add_rays(patch, view.image, rays).ok());
  EXPECT_EQ(at(rays, finer(4), 600, 300), 0) << "something came";
}

}  // namespace
}  // namespace telesplat::viewer
