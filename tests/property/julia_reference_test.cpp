// Surface points of the Julia sampler against a slow marcher in double precision with 128 iterations, on random rays:
// 99.9 % of the rays that meet the set must agree within half a pixel's footprint, measured along the ray; a ray counts
// as wrong if only one of the two meets the set. TELESPLAT_JULIA_RAYS sets the number of rays.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "common/geometry/trajectory.h"
#include "services/sampler/julia/sampler.h"
#include "tests/support/julia/reference.h"

namespace telesplat::sampler {
namespace {

size_t rays_in_all() {
  const char* text = std::getenv("TELESPLAT_JULIA_RAYS");
  return text ? std::strtoull(text, nullptr, 10) : 100000;
}

struct Agreement {
  size_t rays = 0, both = 0, only_sampler = 0, only_reference = 0, apart = 0;
  std::vector<double> errors;  // footprints
  size_t wrong() const { return only_sampler + only_reference + apart; }
};

// Cameras about the set, near and far, that look at points in its box; pixels in rows of eight at random places of 1024
// x 640.
Agreement compare(const julia::Parameters& parameters, size_t rays, unsigned seed) {
  const julia::Placement placement = julia::place(julia::bounds(parameters), 0.8);
  const JuliaScene scene(parameters, placement);
  const test::JuliaReference reference(parameters, placement);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1), distance(0.35, 1.2);
  const auto vector = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
  JuliaSampler sampler(1);
  Agreement out;
  while (out.rays < rays) {
    const glm::dvec3 target = 0.6 * vector() * glm::dvec3(placement.box_room.hi);
    const geometry::Pose pose = geometry::look_at(distance(random) * glm::normalize(vector()), target);
    const geometry::Camera camera = geometry::make_camera(pose, 90, 1024, 640);
    for (int i = 0; i < 16; ++i) {
      const geometry::Rect rect{static_cast<int>(random() % 1016), static_cast<int>(random() % 640), 8, 1};
      const image::DepthImage image = sampler.sample(scene, camera, rect, 1);
      for (int x = 0; x < rect.width; ++x, ++out.rays) {
        const double footprint = 1 / camera.focal_x();
        const glm::dvec3 direction = camera.unproject(rect.x + x + 0.5, rect.y + 0.5, 1) - pose.position_room;
        const auto expected = reference.meet(pose.position_room, direction, footprint, camera.near_m);
        const bool met = image.depth[x] != 0;
        out.only_sampler += met && !expected;
        out.only_reference += !met && expected.has_value();
        if (!met || !expected) continue;
        ++out.both;
        const double error = std::abs(image::decode_depth(image.depth[x], camera.near_m) - *expected) *
                             glm::length(direction) / (footprint * *expected);
        out.errors.push_back(error);
        out.apart += error > 0.5;
      }
    }
  }
  std::sort(out.errors.begin(), out.errors.end());
  return out;
}

TEST(JuliaReference, SurfacePointsLieWithinHalfAFootprint) {
  size_t rays = 0, met = 0, wrong = 0;
  unsigned seed = 1;
  for (const julia::Preset& preset : julia::presets()) {
    const Agreement a = compare(preset.parameters, rays_in_all() / julia::presets().size(), seed++);
    ASSERT_GT(a.both, a.rays / 20) << preset.name;
    printf(
        "%-10s %zu rays, %zu meet the set; wrong: %zu found by the sampler only, %zu by the reference only, %zu apart; "
        "error in footprints: "
        "median %.4f, 99 %% %.4f, 99.9 %% %.4f\n",
        std::string(preset.name).c_str(), a.rays, a.both, a.only_sampler, a.only_reference, a.apart,
        a.errors[a.both / 2], a.errors[a.both * 99 / 100], a.errors[a.both * 999 / 1000]);
    rays += a.rays, met += a.both + a.only_sampler + a.only_reference, wrong += a.wrong();
  }
  printf("all: %zu rays, %zu meet the set, %zu wrong (%.4f %% of these)\n", rays, met, wrong,
         100.0 * double(wrong) / double(met));
  EXPECT_LE(double(wrong), 0.001 * double(met));
}

}  // namespace
}  // namespace telesplat::sampler
