#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/geometry/camera.h"

namespace telesplat::geometry {
namespace {

Camera random_camera(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  const glm::dquat q = glm::normalize(glm::dquat(any(random), any(random), any(random), any(random)));
  Camera c = make_camera({{any(random), any(random), any(random)}, q}, 70, 640, 400);
  c.left -= 0.3 * any(random);  // off-axis
  c.top += 0.2 * any(random);
  return c;
}

TEST(Camera, LooksAlongItsNegativeZWithYUp) {
  const Camera c = make_camera({}, 90, 200, 100);
  const glm::dvec3 centre = c.unproject(100, 50, 2.0);
  EXPECT_NEAR(glm::distance(centre, glm::dvec3(0, 0, -2)), 0, 1e-12);
  const glm::dvec3 upper_left = c.unproject(0, 0, 1.0);
  EXPECT_NEAR(glm::distance(upper_left, glm::dvec3(-1, 0.5, -1)), 0, 1e-12);
}

TEST(Camera, ProjectionInvertsUnprojection) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const Camera c = random_camera(random);
    const double x = unit(random) * c.width, y = unit(random) * c.height, depth = 0.05 + 5 * unit(random);
    const auto t = c.room_to_pixel();
    const glm::dvec4 p(c.unproject(x, y, depth), 1);
    const double w = glm::dot(t.w, p);
    EXPECT_NEAR(w, depth, 1e-9);
    EXPECT_NEAR(glm::dot(t.x, p) / w, x, 1e-6);
    EXPECT_NEAR(glm::dot(t.y, p) / w, y, 1e-6);
  }
}

TEST(Camera, ACropSeesTheSameThroughItsPixels) {
  std::mt19937 random(2);
  const Camera whole = random_camera(random);
  const Rect rect{128, 64, 100, 50};
  const Camera part = crop(whole, rect);
  for (const auto& [x, y] : {std::pair{0.5, 0.5}, {99.5, 49.5}, {37.25, 12.0}})
    EXPECT_NEAR(glm::distance(part.unproject(x, y, 1.5), whole.unproject(x + rect.x, y + rect.y, 1.5)), 0, 1e-12);
}

TEST(Camera, TheFrustumHoldsWhatIsSeenAndNotWhatLiesBehind) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 200; ++i) {
    const Camera c = random_camera(random);
    const Frustum frustum(c);
    const auto box_at = [](const glm::dvec3& p) { return Box{glm::vec3(p) - 1e-3f, glm::vec3(p) + 1e-3f}; };
    EXPECT_TRUE(
        frustum.may_contain(box_at(c.unproject(unit(random) * c.width, unit(random) * c.height, 0.1 + unit(random)))));
    EXPECT_FALSE(frustum.may_contain(box_at(c.unproject(0.5 * c.width, 0.5 * c.height, -1.0))));
    EXPECT_FALSE(frustum.may_contain(box_at(c.unproject(-0.2 * c.width, 0.5 * c.height, 1.0))));
    EXPECT_FALSE(frustum.may_contain(box_at(c.unproject(0.5 * c.width, 1.2 * c.height, 1.0))));
  }
}

TEST(Camera, ValidationRefusesWhatCannotBeACamera) {
  const Camera good = make_camera({}, 90, 64, 64);
  EXPECT_TRUE(validate(good).ok());
  const auto refused = [&](auto change) {
    Camera c = good;
    change(c);
    return !validate(c).ok();
  };
  EXPECT_TRUE(refused([](Camera& c) { c.pose.position_room.x = std::nan(""); }));
  EXPECT_TRUE(refused([](Camera& c) { c.pose.position_room.y = 1e9; }));
  EXPECT_TRUE(refused([](Camera& c) { c.pose.orientation = {0, 0, 0, 0}; }));
  EXPECT_TRUE(refused([](Camera& c) { c.right = c.left; }));
  EXPECT_TRUE(refused([](Camera& c) { std::swap(c.top, c.bottom); }));
  EXPECT_TRUE(refused([](Camera& c) { c.near_m = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.near_m = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](Camera& c) { c.width = kMaxImageSide + 1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.height = 0; }));
}

TEST(RayAxes, SayWhereAPixelsPointLies) {
  const Camera camera = make_camera({{0.1, 0.2, 0.9}, {0.6, 0, 0.8, 0}}, 70, 103, 61);
  const Rect part{40, 7, 50, 50};
  const auto axes = ray_axes(camera, part);
  for (const auto& [x, y] : {std::pair{0, 0}, {49, 3}, {17, 49}}) {
    const glm::dvec3 place = camera.unproject(part.x + x + 0.5, part.y + y + 0.5, 0.7) - camera.pose.position_room;
    for (int i = 0; i < 3; ++i) {
      const auto& [a, b, c] = axes[static_cast<size_t>(i)];
      EXPECT_NEAR(0.7 * (a * x + b * y + c), place[i], 1e-12);
    }
  }
}

TEST(Subsample, LooksWhereTheFullCameraDoes) {
  const Camera full = make_camera({{0.1, 0.2, 0.9}, {0.6, 0, 0.8, 0}}, 70, 103, 61);
  for (const int step : {1, 2, 3, 4, 16}) {
    const Camera coarse = subsample(full, step);
    EXPECT_EQ(coarse.width, (full.width + step - 1) / step);
    EXPECT_EQ(coarse.height, (full.height + step - 1) / step);
    for (const auto& [i, j] : {std::pair{0, 0}, {3, 2}, {coarse.width - 1, coarse.height - 1}}) {
      const glm::dvec3 a = coarse.unproject(i + 0.5, j + 0.5, 0.7);
      const glm::dvec3 b = full.unproject(step * i + step / 2 + 0.5, step * j + step / 2 + 0.5, 0.7);
      EXPECT_LT(glm::distance(a, b), 1e-12) << step << " " << i << " " << j;
    }
  }
}

TEST(Camera, HalfSizeCoversTwoByTwoPixelsWithEach) {
  for (const auto& [width, height] : {std::pair{102, 60}, {103, 61}, {1, 1}}) {
    const Camera full = make_camera({{0.1, 0.2, 0.9}, {0.6, 0, 0.8, 0}}, 70, width, height), half = half_size(full);
    EXPECT_EQ(half.width, (width + 1) / 2);
    EXPECT_EQ(half.height, (height + 1) / 2);
    for (const auto& [i, j] : {std::pair{0, 0}, {3, 2}, {half.width, half.height}}) {  // corners of pixels
      const glm::dvec3 a = half.unproject(i, j, 0.7), b = full.unproject(2 * i, 2 * j, 0.7);
      EXPECT_LT(glm::distance(a, b), 1e-12) << width << " " << i << " " << j;
    }
  }
}

}  // namespace
}  // namespace telesplat::geometry
