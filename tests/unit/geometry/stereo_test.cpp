// Two eyes, the screen before them, and cameras that cover the view of both.
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/stereo.h"
#include "common/geometry/trajectory.h"
#include "tests/support/eye_cameras.h"

namespace telesplat::geometry {
namespace {

// Returns the homogeneous pixel of a point.
glm::dvec3 project(const Camera& camera, const glm::dvec3& p) {
  const auto t = camera.room_to_pixel();
  const glm::dvec4 h(p, 1);
  return {glm::dot(t.x, h), glm::dot(t.y, h), glm::dot(t.w, h)};
}

glm::dvec2 pixel(const Camera& camera, const glm::dvec3& p) {
  const glm::dvec3 h = project(camera, p);
  return {h.x / h.z, h.y / h.z};
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
  EXPECT_EQ(eyes[0].left, head.left);
  // The left eye sees a point farther to the right in its picture.
  EXPECT_GT(pixel(eyes[0], {0, 0, 0}).x, pixel(eyes[1], {0, 0, 0}).x);
}

TEST(Stereo, WhatLiesInTheScreenIsInOnePlaceOfBothPictures) {
  Camera head = make_camera(look_at({0.2, 0.1, 0.9}, {0, 0, 0}), 80, 640, 400);
  head.left += 0.2, head.right += 0.2;
  const double screen_m = 0.7;
  const auto eyes = eye_cameras(head, 0.064, screen_m);
  for (const double x : {3.0, 320.0, 600.0}) {
    const glm::dvec3 on = head.unproject(x, 100, screen_m), before = head.unproject(x, 100, 0.5),
                     behind = head.unproject(x, 100, 2.0);
    EXPECT_NEAR(pixel(eyes[0], on).x, x, 1e-9);
    EXPECT_NEAR(pixel(eyes[1], on).x, x, 1e-9);
    EXPECT_NEAR(pixel(eyes[0], on).y, pixel(eyes[1], on).y, 1e-9);
    EXPECT_GT(pixel(eyes[0], before).x, pixel(eyes[1], before).x) << "crossed: nearer than the screen";
    EXPECT_LT(pixel(eyes[0], behind).x, pixel(eyes[1], behind).x);
  }
}

TEST(Stereo, EyesLookThroughTheScreenThatFillsTheHeadsView) {
  Camera head = make_camera(look_at({0.2, 0.1, 0.9}, {0, 0, 0}), 80, 640, 400);
  head.top += 0.1, head.bottom += 0.1;
  const Screen screen = screen_before(head, 0.6);
  EXPECT_NEAR(seen_from(screen, head.pose.position_room).z, 0.6, 1e-12);
  const auto eyes = eye_cameras(head, 0.07, 0.6);
  for (const Camera& eye : eyes) {
    const Camera through = camera_through(screen, eye.pose.position_room, 640, 400, head.near_m);
    EXPECT_NEAR(through.left, eye.left, 1e-12);
    EXPECT_NEAR(through.right, eye.right, 1e-12);
    EXPECT_NEAR(through.bottom, eye.bottom, 1e-12);
    EXPECT_NEAR(through.top, eye.top, 1e-12);
  }
  const Camera again = camera_through(screen, head.pose.position_room, 640, 400, head.near_m);
  EXPECT_NEAR(again.left, head.left, 1e-12);
  EXPECT_NEAR(again.top, head.top, 1e-12);
}

// A turned and tilted head before a screen in the room.
std::array<Camera, 2> eyes_before(const Screen& screen, const glm::dvec3& left, const glm::dvec3& right) {
  return {camera_through(screen, left, 640, 400, 0.02), camera_through(screen, right, 640, 400, 0.02)};
}

TEST(Stereo, WhatAnEyeSeesTheEnclosingCameraSees) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> room(-1.5, 1.5);
  Camera head = make_camera(look_at({0.3, 0.4, 0.8}, {0, 0, 0}), 80, 640, 400);
  Camera aside = head;
  aside.left += 0.6, aside.right += 0.6;
  const Screen screen{look_at({0.3, 0.2, 0.4}, {0, 0, 0}), 0.6, 0.4};
  const std::array pairs{eye_cameras(head, 0.064), eye_cameras(aside, 0.064), eye_cameras(head, 0.064, 0.5),
                         eyes_before(screen, {0.45, 0.4, 0.9}, {0.50, 0.43, 0.87})};
  for (const auto& eyes : pairs) {
    const Camera both = enclosing_camera(eyes);
    int seen = 0, seen_by_one = 0, seen_by_none = 0;
    for (int i = 0; i < 20000; ++i) {
      const glm::dvec3 p(room(rng), room(rng), room(rng));
      const bool l = sees(eyes[0], p), r = sees(eyes[1], p);
      if (l || r) {
        EXPECT_TRUE(sees(both, p)) << p.x << ", " << p.y << ", " << p.z;
      }
      seen += l || r, seen_by_one += l != r, seen_by_none += !l && !r && sees(both, p);
    }
    EXPECT_GT(seen, 300);
    EXPECT_GT(seen_by_one, 10);
    EXPECT_LT(seen_by_none, seen / 2) << "it sees little more";
  }
}

TEST(Stereo, AWidenedViewHasTheDirectionsOfBothEyes) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> share(0, 1), distance(0.25, 5);
  const Camera head = make_camera(look_at({0.3, 0.4, 0.8}, {0, 0, 0}), 80, 640, 400);
  for (const double screen_m : {0.4, 0.8, 3.0}) {
    const auto eyes = eye_cameras(head, 0.064, screen_m);
    const Camera wide = widened_for(head, eyes, 0.25);
    EXPECT_NEAR(wide.focal_x() / head.focal_x(), 1, 0.003) << "pixels stay as large";
    EXPECT_EQ(wide.height, head.height);
    EXPECT_EQ(wide.pose, head.pose);
    EXPECT_LT(wide.width, head.width * 1.2);
    for (int i = 0; i < 2000; ++i) {
      const Camera& eye = eyes[size_t(i % 2)];
      EXPECT_TRUE(sees(wide, eye.unproject(share(rng) * eye.width, share(rng) * eye.height, distance(rng))));
    }
  }
}

}  // namespace
}  // namespace telesplat::geometry
