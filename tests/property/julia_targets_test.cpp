// The Julia kernel on every instruction set against the scalar oracle: equal images, to the bit.
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/trajectory.h"
#include "services/sampler/julia/sampler.h"
#include "tests/support/julia/plain.h"
#include "tests/support/simd_targets.h"

namespace telesplat::sampler {
namespace {

TEST(JuliaTargets, EveryTargetEqualsTheOracle) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1), distance(0.05, 1.5);
  const auto vector = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
  size_t covered = 0;
  int round = 0;
  for (const julia::Preset& preset : julia::presets())
    for (const auto colour : {julia::Colour::kDistance, julia::Colour::kTrap, julia::Colour::kTrapPlane}) {
      julia::Parameters parameters = preset.parameters;
      parameters.colour = colour;
      parameters.shadow = round % 2;
      parameters.iterations = round % 4 == 3 ? 7 : 64;
      parameters.slice_turn_deg = 40.0 * vector();
      parameters.slice_offset = 0.2 * unit(random);
      if (round % 5 == 4) parameters.bound = 0.6;
      const julia::Placement placement{0.1 * vector(), 0.35, {glm::vec3(-0.4f), glm::vec3(0.4f)}};
      const JuliaScene scene(parameters, placement);
      const geometry::Pose pose = geometry::look_at(distance(random) * glm::normalize(vector()), 0.1 * vector());
      const geometry::Camera camera = geometry::make_camera(pose, 90, 101 + round, 53);
      const geometry::Rect rect{round % 3, round % 7, 101, 40};
      const int step = round % 2 ? 1 : 4;
      const image::DepthImage expected = JuliaSampler(1, julia_trace_plainly).sample(scene, camera, rect, 1.0 / step);
      covered += static_cast<size_t>(
          std::count_if(expected.depth.begin(), expected.depth.end(), [](uint32_t d) { return d != 0; }));
      for (const int64_t target : testing::simd_targets()) {
        const testing::OnTarget on(target);
        const image::DepthImage image = JuliaSampler(1 + round % 2).sample(scene, camera, rect, 1.0 / step);
        ASSERT_TRUE(image == expected) << preset.name << " on " << hwy::TargetName(target) << ", round " << round;
      }
      ++round;
    }
  EXPECT_GT(covered, size_t(round) * 101 * 40 / 10);
}

}  // namespace
}  // namespace telesplat::sampler
