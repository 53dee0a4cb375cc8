// Eyes of a headset as cameras.
#include "client/displays/xr/xr_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client/viewer/display/eyes/eye_rig.h"

namespace telesplat::viewer {
namespace {

constexpr double kRadians = 3.14159265358979323846 / 180;

XrView eye(double x, double left_deg, double right_deg, double cant_deg) {
  const glm::dquat q = glm::angleAxis(cant_deg * kRadians, glm::dvec3(0, 1, 0));
  XrView out{XR_TYPE_VIEW};
  out.pose = {{float(q.x), float(q.y), float(q.z), float(q.w)}, {float(x), 1.5f, 0}};
  out.fov = {float(left_deg * kRadians), float(right_deg * kRadians), float(45 * kRadians), float(-48 * kRadians)};
  return out;
}

TEST(XrSpace, AnEyeBecomesACamera) {
  const auto camera = eye_camera(eye(-0.03, -50, 40, 0), {0, 1.1, -1}, 1000, 900, 0.05);
  EXPECT_NEAR(camera.left, std::tan(-50 * kRadians), 1e-6);
  EXPECT_NEAR(camera.top, 1, 1e-6);
  EXPECT_NEAR(camera.pose.position_room.y, 0.4, 1e-6);
  EXPECT_NEAR(camera.pose.position_room.z, 1, 1e-6);
  EXPECT_TRUE(geometry::validate(camera));
}

// The camera of both eyes sees every random point that one eye sees, for several cants of the eyes.
TEST(XrSpace, BothEyesSeeNothingThatTheirCameraDoesNot) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  for (const double cant_deg : {-8.0, 0.0, 8.0}) {
    const std::array eyes{eye_camera(eye(-0.032, -50, 42, cant_deg), {}, 800, 820, 0.02),
                          eye_camera(eye(0.032, -42, 50, -cant_deg), {}, 800, 820, 0.02)};
    const geometry::Camera both = both_eyes(eyes);
    ASSERT_TRUE(geometry::validate(both));
    const geometry::Frustum frustum(both);
    for (int i = 0; i < 20'000; ++i) {
      const auto& e = eyes[size_t(i % 2)];
      const glm::dvec3 p = e.unproject(share(random) * e.width, share(random) * e.height, 0.02 + 5 * share(random));
      const glm::vec3 lo(p - 1e-6), hi(p + 1e-6);
      EXPECT_TRUE(frustum.may_contain({lo, hi})) << cant_deg;
    }
    // The camera lies behind the eyes, not far, and its pixels are as fine.
    const double behind = both.pose.position_room.z;
    EXPECT_GT(behind, 0);
    EXPECT_LT(behind, 0.05);
    EXPECT_NEAR(both.focal_x(), eyes[0].focal_x(), 0.01 * eyes[0].focal_x());
  }
}

// The camera between the eyes decides the sizes of splats: it is as far from surfaces as the eyes are.
TEST(XrSpace, WhatStandsBetweenTheEyesIsAsNearAsThey) {
  const std::array eyes{eye_camera(eye(-0.032, -50, 42, 0), {}, 800, 820, 0.02),
                        eye_camera(eye(0.032, -42, 50, 0), {}, 800, 820, 0.02)};
  const geometry::Camera middle = between(eyes);
  EXPECT_LT(glm::distance(middle.pose.position_room, glm::dvec3(0, 1.5, 0)), 1e-6);
  EXPECT_EQ(middle.pose.orientation, eyes[0].pose.orientation);
  EXPECT_EQ(middle.focal_x(), eyes[0].focal_x());
  EXPECT_GT(both_eyes(eyes).pose.position_room.z, middle.pose.position_room.z);
}

// Neighbouring codes of 16 bits at a metre, in the coding of the depth that the runtime gets.
TEST(XrSpace, StepsOfDepthAreThoseOfSixteenBits) {
  for (const double near_m : {0.002, 0.02, 0.5}) {
    const double far_m = 100;
    const auto depth_of = [&](double code) { return near_m * far_m / (far_m - code / 65535 * (far_m - near_m)); };
    double code = 0;
    while (depth_of(code) < 1) ++code;
    EXPECT_NEAR(step_of_depth_m(near_m, far_m), depth_of(code) - depth_of(code - 1),
                0.05 * (depth_of(code) - depth_of(code - 1)));
  }
  EXPECT_LT(step_of_depth_m(0.02, 100), 0.8e-3);
  EXPECT_GT(step_of_depth_m(0.002, 100), 7e-3);
}

TEST(XrSpace, EyesInOnePlaceAreTheirOwnCamera) {
  const auto one = eye_camera(eye(0, -45, 45, 0), {}, 640, 640, 0.02);
  const auto both = both_eyes({one, one});
  EXPECT_NEAR(glm::distance(both.pose.position_room, one.pose.position_room), 0, 1e-9);
  EXPECT_NEAR(both.left, one.left, 1e-9);
  EXPECT_EQ(both.width, one.width);
}

}  // namespace
}  // namespace telesplat::viewer
