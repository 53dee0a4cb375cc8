// Fitted views, for any shape of box and picture: all corners are in the picture, with a margin, and fill it well.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/geometry/fit.h"

namespace telesplat::geometry {
namespace {

// Returns the corners' largest coordinate in the picture, whose edges are at 1; infinite if one is behind `near_m`.
double reach(const Box& box, const Pose& pose, Camera camera) {
  camera.pose = pose;
  const auto t = camera.room_to_pixel();
  double out = 0;
  for (int c = 0; c < 8; ++c) {
    const glm::dvec4 p(c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z, 1);
    const double w = glm::dot(t.w, p);
    if (!(w > camera.near_m)) return std::numeric_limits<double>::infinity();
    out = std::max({out, std::abs(2 * glm::dot(t.x, p) / w / camera.width - 1),
                    std::abs(2 * glm::dot(t.y, p) / w / camera.height - 1)});
  }
  return out;
}

double nearest_depth(const Box& box, const Pose& pose) {
  double out = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 8; ++c) {
    const glm::dvec3 p(c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z);
    out = std::min(out, glm::dot(p - pose.position_room, pose.orientation * glm::dvec3(0, 0, -1)));
  }
  return out;
}

// Returns the lowest and the highest of the corners in the picture, whose edges are at -1 and 1.
std::pair<double, double> heights(const Box& box, const Pose& pose, Camera camera) {
  camera.pose = pose;
  const auto t = camera.room_to_pixel();
  std::pair out{1e300, -1e300};
  for (int c = 0; c < 8; ++c) {
    const glm::dvec4 p(c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z, 1);
    const double y = 1 - 2 * glm::dot(t.y, p) / glm::dot(t.w, p) / camera.height;
    out = {std::min(out.first, y), std::max(out.second, y)};
  }
  return out;
}

struct Case {
  Box box;
  Camera camera;
};

// Towers, plates, beams and blocks of 1 mm to 100 m, anywhere near the centre, in pictures of any aspect.
std::vector<Case> cases() {
  std::mt19937 random(11);
  const auto from = [&](double least, double most) {
    return least * std::pow(most / least, std::uniform_real_distribution<double>()(random));
  };
  std::vector<Case> out;
  for (int i = 0; i < 2000; ++i) {
    const double size = from(1e-3, 100);
    const glm::dvec3 half = glm::dvec3(from(0.01, 1), from(0.01, 1), from(0.01, 1)) * size,
                     centre = i % 2 ? glm::dvec3(0) : glm::dvec3(from(0.01, 1), -from(0.01, 1), from(0.01, 1)) * size;
    const double fov_deg = from(5, 150), near_m = 0.02;
    const int width = int(from(64, 4096)), height = int(from(64, 4096));
    out.push_back(
        {{glm::vec3(centre - half), glm::vec3(centre + half)}, make_camera({}, fov_deg, width, height, near_m)});
  }
  return out;
}

TEST(Fit, TheFirstViewShowsTheWholeBoxAndFillsThePicture) {
  for (const auto& [box, camera] : cases()) {
    const Pose pose = fitted_view(box, camera);
    const double r = reach(box, pose, camera);
    ASSERT_LE(r, 1 - 0.9 * kFitMargin) << box.size().x << " " << box.size().y << " " << box.size().z << ", aspect "
                                       << double(camera.width) / camera.height;
    // As near as possible, unless the near plane would cut the box.
    if (nearest_depth(box, pose) > 1.1 * camera.near_m && r < 1 - 1.1 * kFitMargin)
      ADD_FAILURE() << "fills " << r << " only";
    const auto [low, high] = heights(box, pose, camera);
    ASSERT_NEAR(low, -high, 1e-3) << "as much room above as below";
  }
}

TEST(Fit, EveryPoseOfTheOrbitShowsTheWholeBox) {
  for (const auto& [box, camera] : cases()) {
    const Trajectory orbit = fitted_orbit(box, camera, 20);
    double most = 0;
    for (double t = 0; t < 20; t += 20.0 / 360 * 5) most = std::max(most, reach(box, orbit.at(t), camera));
    ASSERT_LE(most, 1 - 0.9 * kFitMargin) << box.size().x << " " << box.size().y << " " << box.size().z;
    double low = 1, high = -1;
    for (double t = 0; t < 20; t += 20.0 / 360 * 5) {
      const auto [l, h] = heights(box, orbit.at(t), camera);
      low = std::min(low, l), high = std::max(high, h);
    }
    ASSERT_LT(std::abs(low + high), 0.35 * (high - low)) << "about as much room above as below";
    // As near as possible: the extreme points of its upright cylinder touch the margin somewhere, corners nearly.
    const double distance = glm::distance(orbit.at(0).position_room, glm::dvec3(box.centre()));
    if (distance > 20 * camera.near_m) {
      ASSERT_GT(most, 0.8) << "it is lost in the picture";
    }
  }
}

TEST(Fit, FlatThingsAreSeenFromAboveAndTowersFromTheSide) {
  const double degree = 3.14159265358979 / 180;
  const Box plate{{-1, -0.05f, -1}, {1, 0.05f, 1}}, cube{{-1, -1, -1}, {1, 1, 1}},
      tower{{-.1f, -1, -.1f}, {.1f, 1, .1f}};
  EXPECT_NEAR(suitable_tilt_rad(plate), 34 * degree, 0.5 * degree);
  EXPECT_LT(suitable_tilt_rad(cube), suitable_tilt_rad(plate));
  EXPECT_LT(suitable_tilt_rad(tower), 12 * degree);
  EXPECT_GT(suitable_tilt_rad(tower), 9 * degree);
  // In front, level, at the centre.
  const Camera camera = make_camera({}, 90, 1280, 800);
  const Pose pose = fitted_view(cube, camera);
  EXPECT_NEAR(pose.position_room.x, 0, 1e-12);
  EXPECT_GT(pose.position_room.z, 0);
  EXPECT_NEAR((pose.orientation * glm::dvec3(1, 0, 0)).y, 0, 1e-12);
  EXPECT_NEAR(glm::distance(fitted_orbit(cube, camera).at(0).position_room.x, 0.0), 0, 1e-12);
}

TEST(Fit, BoxesWithoutWidthOrHeightHaveViewsToo) {
  const Camera camera = make_camera({}, 60, 640, 400);
  for (const Box& box : {Box{{0, 0, 0}, {0, 0, 0}}, Box{{-1, 0, -1}, {1, 0, 1}}, Box{{0, -1, 0}, {0, 1, 0}},
                         Box{{-1e30f, -1e30f, -1e30f}, {1e30f, 1e30f, 1e30f}}}) {
    Camera c = camera;
    c.pose = fitted_view(box, camera);
    EXPECT_TRUE(validate(c).ok());
    c.pose = fitted_orbit(box, camera).at(3);
    EXPECT_TRUE(validate(c).ok());
  }
}

}  // namespace
}  // namespace telesplat::geometry
