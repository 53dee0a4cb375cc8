// Two eyes, and the camera that sees what both see.
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/stereo.h"
#include "common/geometry/trajectory.h"

namespace telesplat::geometry {
namespace {

// Homogeneous pixels of a point.
glm::dvec3 project(const Camera& camera, const glm::dvec3& p) {
  const auto t = camera.room_to_pixel();
  const glm::dvec4 h(p, 1);
  return {glm::dot(t.x, h), glm::dot(t.y, h), glm::dot(t.w, h)};
}

bool sees(const Camera& camera, const glm::dvec3& p) {
  const glm::dvec3 h = project(camera, p);
  return h.z >= camera.near_m && h.x >= 0 && h.y >= 0 && h.x <= camera.width * h.z && h.y <= camera.height * h.z;
}

TEST(Stereo, EyesStandApartBesideTheHead) {
  const Camera head = make_camera(look_at({0.2, 0.1, 0.9}, {0, 0, 0}), 90, 640, 400);
  const auto eyes = eye_cameras(head, 0.064);
  EXPECT_NEAR(glm::distance(eyes[0].pose.position_room, eyes[1].pose.position_room), 0.064, 1e-12);
  EXPECT_NEAR(glm::distance(0.5 * (eyes[0].pose.position_room + eyes[1].pose.position_room), head.pose.position_room),
              0, 1e-12);
  // What the left eye sees lies farther to the right in its picture.
  EXPECT_GT(project(eyes[0], {0, 0, 0}).x / project(eyes[0], {0, 0, 0}).z,
            project(eyes[1], {0, 0, 0}).x / project(eyes[1], {0, 0, 0}).z);
}

TEST(Stereo, WhatAnEyeSeesTheEnclosingCameraSees) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> room(-1.5, 1.5);
  for (const double shift : {0.0, -0.4, 0.6}) {
    Camera head = make_camera(look_at({0.3, 0.4, 0.8}, {0, 0, 0}), 80, 640, 400);
    head.left += shift, head.right += shift;
    const auto eyes = eye_cameras(head, 0.064);
    const Camera both = enclosing_camera(head, 0.064);
    int seen = 0, seen_by_one = 0, seen_by_none = 0;
    for (int i = 0; i < 20000; ++i) {
      const glm::dvec3 p(room(rng), room(rng), room(rng));
      const bool l = sees(eyes[0], p), r = sees(eyes[1], p);
      if (l || r) {
        EXPECT_TRUE(sees(both, p)) << p.x << ", " << p.y << ", " << p.z;
      }
      seen += l || r, seen_by_one += l != r, seen_by_none += !l && !r && sees(both, p);
    }
    EXPECT_GT(seen, 500);
    EXPECT_GT(seen_by_one, 10);
    EXPECT_LT(seen_by_none, seen / 3) << "it sees little more";
  }
}

}  // namespace
}  // namespace telesplat::geometry
