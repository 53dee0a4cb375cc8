#include "common/volume/shear.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include <random>

namespace telesplat::volume {
namespace {

Grid a_grid() {
  Grid g{{60, 50, 40}, glm::dmat4(1)};
  g.index_to_room = glm::translate(glm::dmat4(1), glm::dvec3(-0.3, -0.2, -0.25));
  g.index_to_room = glm::rotate(g.index_to_room, 0.2, glm::dvec3(0.3, 1, 0.2));
  g.index_to_room = glm::scale(g.index_to_room, glm::dvec3(0.01, 0.009, 0.014));
  return g;
}

geometry::Camera looking(const Grid& grid, const glm::dvec3& from, int width = 320, int height = 240) {
  const glm::dvec3 forward = glm::normalize(grid.centre_room() - from);
  const glm::dvec3 up = std::abs(forward.y) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  return geometry::make_camera({from, glm::quatLookAt(forward, up)}, 70, width, height);
}

std::vector<glm::dvec3> eyes() {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<glm::dvec3> out;
  while (out.size() < 60) {
    const glm::dvec3 p(u(random), u(random), u(random));
    if (glm::length(p) > 0.6) out.push_back(p);
  }
  return out;
}

// For every principal axis in both directions: a display pixel of the sampled camera sees the same pixel of the frame
// in every layer.
TEST(VolumeShear, WarpOfTheSampledViewIsTheSamePixelInEveryLayer) {
  const Grid grid = a_grid();
  int seen[3][2] = {};
  for (const auto& eye : eyes()) {
    const auto camera = looking(grid, eye);
    const auto frame = plan_frame(grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    ASSERT_TRUE(validate(*frame, grid)) << validate(*frame, grid).error().text;
    ++seen[frame->axis][frame->direction > 0];
    for (const auto& layer : frame->layers) {
      const auto m = warp(grid, *frame, layer.plane, camera);
      ASSERT_TRUE(m);
      for (const auto& [px, py] : {std::pair{160.0, 120.0}, {40.5, 200.25}, {300.0, 10.0}}) {
        const glm::dvec3 h = *m * glm::dvec3(px, py, 1);
        if (h.z <= 0) continue;
        const glm::dvec3 at = frame->unproject(h.x / h.z, h.y / h.z, layer.plane);
        const glm::dvec3 room = grid.index_to_room * glm::dvec4(at, 1);
        const auto t = camera.room_to_pixel();
        const glm::dvec4 p(room, 1);
        const double w = glm::dot(t.w, p);
        EXPECT_NEAR(glm::dot(t.x, p) / w, px, 1e-6);
        EXPECT_NEAR(glm::dot(t.y, p) / w, py, 1e-6);
      }
    }
    const glm::dvec3 first = *warp(grid, *frame, frame->layers.front().plane, camera) * glm::dvec3(100, 90, 1);
    const glm::dvec3 last = *warp(grid, *frame, frame->layers.back().plane, camera) * glm::dvec3(100, 90, 1);
    EXPECT_NEAR(first.x / first.z, last.x / last.z, 1e-6);
    EXPECT_NEAR(first.y / first.z, last.y / last.z, 1e-6);
  }
  for (const auto& axis : seen)
    for (const int n : axis) EXPECT_GT(n, 0);
}

// T eq. 4.10-4.12: with the eye permuted, a point of slice z goes to (x + z s_x) / (1 + z s_w) on the compositing plane
// z = 0.
TEST(VolumeShear, IsTheShearMatrixOfTheThesis) {
  const Grid grid = a_grid();
  for (const auto& eye : eyes()) {
    const auto camera = looking(grid, eye);
    const auto frame = plan_frame(grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    const glm::dvec3 e(frame->eye[frame->u()], frame->eye[frame->v()], frame->eye[frame->axis]);
    if (std::abs(e.z) < 1e-3) continue;
    const double sx = -e.x / e.z, sy = -e.y / e.z, sw = -1 / e.z;
    for (const int slice : {frame->layers.front().begin, frame->layers.back().end - 1})
      for (const auto& [x, y] : {std::pair{10.0, 20.0}, {0.5, 70.25}}) {
        const glm::dvec3 p = frame->unproject(x, y, slice);
        const double w = 1 + slice * sw;
        const double image_x = (p[frame->u()] + slice * sx) / w, image_y = (p[frame->v()] + slice * sy) / w;
        const glm::dvec3 on_plane = frame->unproject(x, y, 0);
        EXPECT_NEAR(image_x, on_plane[frame->u()], 1e-6 * (1 + std::abs(image_x)));
        EXPECT_NEAR(image_y, on_plane[frame->v()], 1e-6 * (1 + std::abs(image_y)));
      }
  }
}

TEST(VolumeShear, RasterHoldsWhateverTheCameraSees) {
  const Grid grid = a_grid();
  std::mt19937_64 random(3);
  for (const auto& eye : eyes()) {
    const auto camera = looking(grid, eye);
    const auto frame = plan_frame(grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    const auto t = camera.room_to_pixel();
    for (int n = 0; n < 300; ++n) {
      glm::dvec3 at;
      for (int a = 0; a < 3; ++a) at[a] = std::uniform_real_distribution<double>(0, grid.size[size_t(a)] - 1)(random);
      const glm::dvec4 room = grid.index_to_room * glm::dvec4(at, 1);
      const double w = glm::dot(t.w, room), px = glm::dot(t.x, room) / w, py = glm::dot(t.y, room) / w;
      const bool covered = std::any_of(frame->layers.begin(), frame->layers.end(), [&](const Layer& l) {
        return at[frame->axis] >= l.begin && at[frame->axis] <= l.end - 1;
      });
      if (!covered || w <= 0 || px < 0 || py < 0 || px > camera.width || py > camera.height) continue;
      const double d = frame->t(at[frame->axis]);
      const double x = ((at[frame->u()] - frame->eye[frame->u()]) / d - frame->u0) / frame->du;
      const double y = ((at[frame->v()] - frame->eye[frame->v()]) / d - frame->v0) / frame->dv;
      EXPECT_TRUE(x >= -1e-6 && y >= -1e-6 && x <= frame->width + 1e-6 && y <= frame->height + 1e-6) << x << " " << y;
    }
  }
}

TEST(VolumeShear, SlabsShareOutEveryPixelOfASlice) {
  const Grid grid = a_grid();
  for (const auto& eye : eyes()) {
    const auto camera = looking(grid, eye);
    const auto frame = plan_frame(grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    if (frame->axis == 2) continue;
    for (const auto& layer : frame->layers)
      for (const int slice : {layer.begin, layer.end - 1}) {
        int next = 0;
        for (const auto& [from, to] : {std::pair{0, 7}, {7, 8}, {8, 31}, {31, 40}}) {
          const auto [first, second] = owned_pixels(grid, *frame, slice, from, to);
          EXPECT_EQ(first, next);
          EXPECT_GE(second, first);
          next = second;
        }
        EXPECT_EQ(next, frame->axis == 0 ? frame->height : frame->width);
      }
  }
}

TEST(VolumeShear, EyeInsideSeesOnlyWhatIsInFront) {
  const Grid grid = a_grid();
  const glm::dvec3 inside = grid.index_to_room * glm::dvec4(30, 25, 12.3, 1);
  const glm::dvec3 ahead = grid.index_to_room * glm::dvec4(30, 25, 39, 1);
  const auto camera = geometry::make_camera(
      {inside, glm::quatLookAt(glm::normalize(ahead - inside), glm::dvec3(0, 1, 0))}, 90, 100, 100);
  const auto frame = plan_frame(grid, std::span(&camera, 1));
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->axis, 2);
  EXPECT_EQ(frame->direction, 1);
  EXPECT_EQ(frame->layers.front().begin, 14);
  EXPECT_TRUE(validate(*frame, grid));
  const auto away =
      geometry::make_camera({{0, 0, 5}, glm::quatLookAt(glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0))}, 60, 100, 100);
  EXPECT_FALSE(plan_frame(grid, std::span(&away, 1)));
}

// An eye just above the top slice that looks along it: the slices across the look are the ones to splat.
TEST(VolumeShear, EyeThatSkimsAFaceSamplesAlongItsLook) {
  const Grid grid = a_grid();
  const glm::dvec3 eye = grid.index_to_room * glm::dvec4(-3, 25, 40.5, 1);
  const glm::dvec3 ahead = grid.index_to_room * glm::dvec4(60, 25, 38, 1);
  const auto camera =
      geometry::make_camera({eye, glm::quatLookAt(glm::normalize(ahead - eye), glm::dvec3(0, 1, 0))}, 80, 200, 100);
  const auto frame = plan_frame(grid, std::span(&camera, 1));
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->axis, 0);
  EXPECT_EQ(frame->direction, 1);
  EXPECT_LT(frame->width, 1000);
  EXPECT_LT(frame->height, 1000);
}

}  // namespace
}  // namespace telesplat::volume
