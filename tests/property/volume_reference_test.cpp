// Splatted, layered, rounded to 8 bits and warped pictures, against rays in double precision.
#include <gtest/gtest.h>

#include "services/sampler/volume/raycaster.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/volume/scenes.h"

namespace telesplat::sampler {
namespace {

constexpr uint32_t kBackground = 0x00141820;

std::vector<volume::LevelColour> solid(double opacity) {
  auto out = test::ramp(0.5);
  for (auto& c : out)
    if (c.extinction > 0) c.extinction = float(-std::log(1 - opacity));
  return out;
}

double sphere(glm::dvec3 p) { return glm::length(p) < 0.7 ? 0.5 + 0.4 * p.x * p.y : 0.0; }

struct Case {
  const char* name;
  test::VolumeScene scene;
};

std::vector<Case> cases() {
  const auto cube = test::make_grid({48, 48, 48}, 0.5);
  const auto skewed = test::make_grid({40, 56, 32}, 0.5, {1, 0.8, 1.6}, 30, glm::normalize(glm::dvec3(1, 2, 3)));
  std::vector<Case> out;
  out.push_back({"blobs", test::make_scene(cube, test::blobs, test::ramp(0.3))});
  out.push_back({"dense blobs", test::make_scene(cube, test::blobs, test::ramp(0.95))});
  out.push_back({"sphere", test::make_scene(cube, sphere, solid(0.3))});
  out.push_back({"opaque sphere", test::make_scene(cube, sphere, solid(0.95))});
  out.push_back({"blobs, turned", test::make_scene(skewed, test::blobs, test::ramp(0.6))});
  out.push_back({"sphere, turned", test::make_scene(skewed, sphere, solid(0.9))});
  return out;
}

TEST(VolumeReference, SplattedLayersLookLikeRays) {
  for (const Case& c : cases()) {
    const VolumeRaycaster reference(c.scene.grid, c.scene.voxels, c.scene.colours, 2);
    const SlabVolume volume(c.scene.grid, c.scene.voxels);
    for (int view = 0; view < 6; ++view) {
      glm::dvec3 eye(0.35, 0.25, 0.4);
      eye[view % 3] = view / 3 ? 1 : -1;
      eye = 0.95 * glm::normalize(eye);
      const auto look = [](const glm::dvec3& at) {
        return geometry::make_camera(geometry::look_at(at, glm::dvec3(0)), 40, 160, 120);
      };
      const auto camera = look(eye);
      const auto frame = volume::plan_frame(c.scene.grid, std::span(&camera, 1));
      ASSERT_TRUE(frame);
      const auto images = ShearSplatter(2).splat(volume, c.scene.colours, *frame, {0, c.scene.grid.size[2]});
      const double at_pose =
          test::psnr(reference.draw(camera, kBackground),
                     test::warp_plainly(c.scene.grid, *frame, images, camera, kBackground), kBackground);
      const glm::dvec3 about = glm::normalize(glm::cross(eye, glm::dvec3(0.3, 1, 0.2)));
      const auto beside = look(glm::dmat3(glm::rotate(glm::dmat4(1.0), glm::radians(5.0), about)) * eye);
      const double moved =
          test::psnr(reference.draw(beside, kBackground),
                     test::warp_plainly(c.scene.grid, *frame, images, beside, kBackground), kBackground);
      EXPECT_GE(at_pose, 32) << c.name << ", view " << view;
      EXPECT_GE(moved, 26) << c.name << ", view " << view;
      // A wrong picture, half as opaque, is far outside these limits.
      if (view == 0) {
        auto half = c.scene.colours;
        for (auto& level : half) level.extinction /= 2;
        const auto wrong = ShearSplatter(1).splat(volume, half, *frame, {0, c.scene.grid.size[2]});
        EXPECT_LT(test::psnr(reference.draw(camera, kBackground),
                             test::warp_plainly(c.scene.grid, *frame, wrong, camera, kBackground), kBackground),
                  at_pose - 6)
            << c.name;
      }
    }
  }
}

// The eye in the middle of a shell, looking along all axes.
TEST(VolumeReference, EyeInside) {
  const auto grid = test::make_grid({48, 48, 48}, 0.5);
  const auto shell = [](glm::dvec3 p) {
    const double r = glm::length(p);
    return r > 0.45 ? std::exp(-std::pow((r - 0.7) / 0.12, 2)) * (0.6 + 0.4 * std::sin(6 * p.x) * std::cos(5 * p.y))
                    : 0.0;
  };
  const auto scene = test::make_scene(grid, shell, test::ramp(0.5));
  const VolumeRaycaster reference(grid, scene.voxels, scene.colours, 2);
  const SlabVolume volume(grid, scene.voxels);
  for (int view = 0; view < 6; ++view) {
    glm::dvec3 at(0.1, 0.05, 0.08);
    at[view % 3] = view / 3 ? 1 : -1;
    const auto camera = geometry::make_camera(geometry::look_at({0.01, -0.02, 0.015}, at), 60, 160, 120);
    // The nearest slice is one voxel away, and PlanOptions::finest would make pixels of several voxels of the shell:
    // sample as finely as displayed.
    const auto frame = volume::plan_frame(grid, std::span(&camera, 1), {.finest = 0.01});
    ASSERT_TRUE(frame);
    const auto images = ShearSplatter(2).splat(volume, scene.colours, *frame, {0, 48});
    const auto expected = reference.draw(camera, kBackground);
    EXPECT_GE(test::psnr(expected, test::warp_plainly(grid, *frame, images, camera, kBackground), kBackground), 32)
        << "view " << view;
    EXPECT_GT(
        std::count_if(expected.colour.begin(), expected.colour.end(), [](uint32_t c) { return c != kBackground; }),
        160 * 120 / 2);
  }
}

}  // namespace
}  // namespace telesplat::sampler
