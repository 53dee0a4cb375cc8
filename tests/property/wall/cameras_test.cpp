// Screens of a wall show one picture together: random walls, heads and points.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "client/wall/screen_camera.h"
#include "common/geometry/trajectory.h"

namespace telesplat::wall {
namespace {

struct Random {
  std::mt19937_64 bits;
  double in(double least, double most) { return std::uniform_real_distribution(least, most)(bits); }
  glm::dvec3 point(double most) { return {in(-most, most), in(-most, most), in(-most, most)}; }
  glm::dquat turn() {
    const glm::dvec3 axis = glm::normalize(point(1) + glm::dvec3(1e-3));
    return glm::angleAxis(in(-3, 3), axis);
  }
};

// Returns a point's pixel in the camera; nothing: it is behind.
std::optional<glm::dvec2> pixel_of(const geometry::Camera& camera, const glm::dvec3& point) {
  const auto t = camera.room_to_pixel();
  const glm::dvec4 p(point, 1);
  const double w = glm::dot(t.w, p);
  if (w <= 0) return std::nullopt;
  return glm::dvec2(glm::dot(t.x, p) / w, glm::dot(t.y, p) / w);
}

Wall parsed(const std::string& text) {
  const auto wall = parse_wall(text, "random.toml");
  EXPECT_TRUE(wall.ok()) << (wall ? "" : wall.error().text);
  return *wall;
}

std::string plane(int columns, int rows, double width, double height, int across, int down) {
  return fmt::format(
      "[head]\nposition = [0.1, -0.2, 0.9]\n[[planar]]\ncolumns = {}\nrows = {}\nsize = [{}, {}]\nresolution = [{}, "
      "{}]\n",
      columns, rows, width, height, across, down);
}

// Four corners are the same, and so is the ray through each pixel.
TEST(WallCameras, APlaneOfFourIsOneLargeScreen) {
  Random random{std::mt19937_64(1)};
  for (const char* anchor : {"room", "head"}) {
    const std::string header = fmt::format("[wall]\nanchor = \"{}\"\n", anchor);
    const Wall four = parsed(header + plane(2, 2, 0.5, 0.3, 200, 120)),
               one = parsed(header + plane(1, 1, 1, 0.6, 400, 240));
    for (int n = 0; n < 200; ++n) {
      const geometry::Pose head{random.point(0.6) + glm::dvec3(0, 0, 1), random.turn()};
      const geometry::Camera whole = screen_camera(one, 0, head, 0.02);
      ASSERT_TRUE(geometry::validate(whole).ok());
      for (int i = 0; i < 4; ++i) {
        const geometry::Camera part = screen_camera(four, i, head, 0.02),
                               crop = geometry::crop(whole, {i % 2 * 200, i / 2 * 120, 200, 120});
        EXPECT_LT(glm::distance(part.pose.position_room, crop.pose.position_room), 1e-12);
        EXPECT_NEAR(std::abs(glm::dot(part.pose.orientation, crop.pose.orientation)), 1, 1e-12);
        for (const auto& [a, b] : {std::pair(part.left, crop.left),
                                   {part.right, crop.right},
                                   {part.bottom, crop.bottom},
                                   {part.top, crop.top}})
          EXPECT_NEAR(a, b, 1e-9 * std::max(1.0, std::abs(b)));
      }
    }
  }
}

// Where screens overlap or meet, any of them shows a point of the room at the same place of the wall.
TEST(WallCameras, APointIsSeenAtOnePlaceOfTheWall) {
  Random random{std::mt19937_64(2)};
  int seen = 0;
  for (int n = 0; n < 300; ++n) {
    // Two screens of one plane, shifted, with different sizes and pixels; a wall anywhere in the room.
    const double dx = random.in(-0.3, 0.3), dy = random.in(-0.2, 0.2);
    const std::string text = fmt::format(
        "[wall]\nposition = [{}, {}, {}]\nturn = [{}, {}, {}]\n[head]\nposition = [0, 0, 0.8]\n"
        "[[screen]]\nposition = [0, 0, 0]\nsize = [0.8, 0.5]\nresolution = [640, 400]\n"
        "[[screen]]\nposition = [{}, {}, 0]\nsize = [0.6, 0.6]\nresolution = [300, 333]\n",
        random.in(-2, 2), random.in(-2, 2), random.in(-2, 2), random.in(-180, 180), random.in(-80, 80),
        random.in(-180, 180), dx, dy);
    const Wall wall = parsed(text);
    const glm::dvec3 eye =
        wall.in_room.position_room + wall.in_room.orientation * (random.point(0.4) + glm::dvec3(0, 0, 0.9));
    const geometry::Pose head{eye, random.turn()};  // its direction changes nothing
    for (int k = 0; k < 20; ++k) {
      const glm::dvec3 point = wall.in_room.position_room + wall.in_room.orientation * random.point(1);
      glm::dvec3 places[2];
      bool both = true;
      for (int i = 0; i < 2; ++i) {
        const Screen& s = wall.screens[size_t(i)];
        const geometry::Camera camera = screen_camera(wall, i, head, 0.02);
        const auto pixel = pixel_of(camera, point);
        both = both && pixel.has_value();
        if (!both) break;
        // The pixel's place on the glass.
        const glm::dvec3 on_screen((pixel->x / s.width - 0.5) * s.width_m, (0.5 - pixel->y / s.height) * s.height_m, 0);
        places[i] = s.pose.position_room + s.pose.orientation * on_screen;
        const auto straight = seen_at(s, wall_in_room(wall, head), eye, point);
        ASSERT_TRUE(straight.has_value());
        EXPECT_LT(glm::distance(glm::dvec3(*straight, 0), on_screen), 1e-6 * (1 + glm::length(on_screen)));
      }
      if (!both) continue;
      ++seen;
      EXPECT_LT(glm::distance(places[0], places[1]), 1e-6 * (1 + glm::length(places[0])));
    }
  }
  EXPECT_GT(seen, 1000);
}

// On a cylinder neighbours meet at an edge: a point on the ray through it is at the edge of both.
TEST(WallCameras, NeighboursOfAnArcMeetAtTheirEdge) {
  Random random{std::mt19937_64(3)};
  for (int n = 0; n < 100; ++n) {
    const double radius = random.in(1, 3);
    const Wall wall =
        parsed(fmt::format("[head]\nposition = [0, 0, 0]\n[[cylindrical]]\ncolumns = 5\nradius = {}\nsize = [0.5, "
                           "0.4]\nresolution = [500, "
                           "400]\n",
                           radius));
    const geometry::Pose head{random.point(0.3), random.turn()};
    for (int i = 0; i + 1 < 5; ++i) {
      const Screen &a = wall.screens[size_t(i)], &b = wall.screens[size_t(i) + 1];
      const double y = random.in(-0.2, 0.2);
      const glm::dvec3 edge = a.pose.position_room + a.pose.orientation * glm::dvec3(a.width_m / 2, y, 0);
      const glm::dvec3 point = head.position_room + random.in(0.5, 4) * (edge - head.position_room);
      const auto in_a = pixel_of(screen_camera(wall, i, head, 0.02), point),
                 in_b = pixel_of(screen_camera(wall, i + 1, head, 0.02), point);
      ASSERT_TRUE(in_a && in_b);
      EXPECT_NEAR(in_a->x, 500, 1e-6) << a.name;
      EXPECT_NEAR(in_b->x, 0, 1e-6) << b.name;
      EXPECT_NEAR(in_a->y, in_b->y, 1e-6);
    }
  }
}

// A wall that moves with the head shows the same as one display before the eyes, at any place of the head.
TEST(WallCameras, AWallThatTheHeadTakesAlongTurnsWithIt) {
  Random random{std::mt19937_64(4)};
  const Wall wall = parsed("[wall]\nanchor = \"head\"\n" + plane(2, 1, 0.5, 0.3, 100, 60));
  const geometry::Camera before = screen_camera(wall, 1, {}, 0.02);
  for (int n = 0; n < 100; ++n) {
    const geometry::Pose head{random.point(5), random.turn()};
    const geometry::Camera camera = screen_camera(wall, 1, head, 0.02);
    EXPECT_NEAR(camera.left, before.left, 1e-9);
    EXPECT_NEAR(camera.top, before.top, 1e-9);
    EXPECT_NEAR(std::abs(glm::dot(camera.pose.orientation, head.orientation)), 1, 1e-12);
    EXPECT_EQ(camera.pose.position_room, head.position_room);
  }
}

// Heads that walk through a screen, or far beside it, still have a valid camera.
TEST(WallCameras, AreValidWhereverTheHeadGoes) {
  Random random{std::mt19937_64(5)};
  const Wall wall = parsed(plane(2, 2, 0.5, 0.3, 200, 120));
  for (int n = 0; n < 2000; ++n) {
    const geometry::Pose head{random.point(n % 2 ? 1 : 30), random.turn()};
    for (int i = 0; i < 4; ++i) {
      const auto valid = geometry::validate(screen_camera(wall, i, head, 0.02));
      EXPECT_TRUE(valid.ok()) << valid.error().text;
    }
  }
}

TEST(WallCameras, AFrustumToFitIntoHasAPlaneWallsEdges) {
  const Wall wall = parsed(plane(2, 2, 0.5, 0.3, 200, 120));
  const geometry::Camera whole = fitting_frustum(wall, 0.02);
  const geometry::Camera corner = screen_camera(wall, 0, {wall.head, {1, 0, 0, 0}}, 0.02);
  EXPECT_NEAR(whole.left, corner.left, 1e-12);
  EXPECT_NEAR(whole.top, corner.top, 1e-12);
  const Wall round = parsed(
      "[head]\nposition = [0, 0, 0]\n[[cylindrical]]\ncolumns = 12\nrows = 2\nradius = 1\nsize = [0.5, 0.4]\n"
      "resolution = [500, 400]\n");
  const geometry::Camera around = fitting_frustum(round, 0.02);
  EXPECT_TRUE(geometry::validate(around).ok());
  EXPECT_NEAR(around.right, std::tan(50 * 3.14159265358979 / 180), 1e-9);
  EXPECT_NEAR(around.top, 0.4, 0.02);
}

}  // namespace
}  // namespace telesplat::wall
