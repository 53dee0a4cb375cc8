// Slices, bounds and the distance estimate of Julia sets, compared with known results.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "common/julia/distance.h"

namespace telesplat::julia {
namespace {

bool inside(const geometry::DBox& box, const glm::dvec3& p) {
  return glm::all(glm::greaterThanEqual(p, box.lo)) && glm::all(glm::lessThanEqual(p, box.hi));
}

Parameters random_parameters(std::mt19937& random) {
  const auto in = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  Parameters p;
  p.c = {in(-0.8, 0.8), in(-0.8, 0.8), in(-0.8, 0.8), in(-1.2, 0.4)};
  p.slice_offset = in(-0.4, 0.4);
  p.slice_turn_deg = {in(-360, 360), in(-360, 360), in(-360, 360)};
  return p;
}

TEST(JuliaSlice, IsOrthonormalAndOffsetAlongItsNormal) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    const Parameters p = random_parameters(random);
    const Slice s = slice(p);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(glm::dot(s.e[i], s.e[j]), i == j ? 1 : 0, 1e-12);
      EXPECT_NEAR(glm::dot(s.e[i], s.origin), 0, 1e-12);
    }
    EXPECT_NEAR(glm::length(s.origin), std::abs(p.slice_offset), 1e-12);
  }
}

TEST(JuliaSlice, TurnsInItsNamedPlanes) {
  Parameters p;
  p.slice_offset = 0.5;
  Slice s = slice(p);
  EXPECT_EQ(s.e[0], glm::dvec4(0, 0, 0, 1));
  EXPECT_EQ(s.e[1], glm::dvec4(1, 0, 0, 0));
  EXPECT_EQ(s.e[2], glm::dvec4(0, 1, 0, 0));
  EXPECT_EQ(s.origin, glm::dvec4(0, 0, 0.5, 0));
  p.slice_turn_deg.x = 90;  // the real axis to k
  s = slice(p);
  EXPECT_NEAR(glm::distance(s.e[0], glm::dvec4(0, 0, 1, 0)), 0, 1e-12);
  EXPECT_EQ(s.e[1], glm::dvec4(1, 0, 0, 0));
  p.slice_turn_deg = {0, 90, 0};
  s = slice(p);
  EXPECT_NEAR(glm::distance(s.e[1], glm::dvec4(0, 0, 1, 0)), 0, 1e-12);
  EXPECT_EQ(s.e[0], glm::dvec4(0, 0, 0, 1));
}

TEST(JuliaBounds, HoldEveryPointThatIsFoundInside) {
  std::mt19937 random(11);
  int shown = 0;
  for (int round = 0; round < 60; ++round) {
    Parameters p = random_parameters(random);
    p.iterations = round % 3 == 0 ? 1 + round / 3 : 64;  // few iterations leave more than the set
    const Slice s = slice(p);
    const geometry::DBox box = bounds(p);
    const double r = radius(p.c);
    const double side = round % 3 == 0 ? 6 : r;
    std::uniform_real_distribution<double> coordinate(-side, side);
    for (int i = 0; i < 10000; ++i) {
      const glm::dvec3 q(coordinate(random), coordinate(random), coordinate(random));
      if (distance_estimate(p, s, q) > 0) continue;
      ++shown;
      EXPECT_TRUE(inside(box, q)) << round << ": " << q.x << " " << q.y << " " << q.z;
      if (p.iterations == 64) {
        EXPECT_LE(glm::length(q), r);
      }
    }
  }
  EXPECT_GT(shown, 5000);
}

TEST(JuliaBounds, AreTight) {
  Parameters ball;  // c = 0
  geometry::DBox box = bounds(ball);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(box.hi[axis], 1);
    EXPECT_LT(box.hi[axis], 1.03);
    EXPECT_LT(-box.lo[axis], 1.03);
  }
  ball.slice_offset = 0.8;  // a ball of radius 0.6
  box = bounds(ball);
  EXPECT_GE(box.hi.x, 0.6);
  EXPECT_LT(box.hi.x, 0.63);
  for (const auto& preset : presets()) {
    const auto& p = preset.parameters;
    const Slice s = slice(p);
    box = bounds(p);
    ASSERT_FALSE(box.empty()) << preset.name;
    std::mt19937 random(13);
    std::uniform_real_distribution<double> part(0, 1);
    geometry::DBox near;
    for (int i = 0; i < 200000; ++i) {
      const glm::dvec3 q = box.lo + box.size() * glm::dvec3(part(random), part(random), part(random));
      if (distance_estimate(p, s, q) < 0.01) near.extend(q);
    }
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_GT(near.size()[axis], 0.88 * box.size()[axis]) << preset.name << " axis " << axis;
  }
}

TEST(JuliaBounds, ABoundIsACubeAndEmptyWhereNothingIs) {
  Parameters p;
  p.bound = 0.25;
  EXPECT_EQ(bounds(p), (geometry::DBox{glm::dvec3(-0.25), glm::dvec3(0.25)}));
  p.slice_offset = 0.99;  // the ball's cap has a radius of 0.14
  EXPECT_FALSE(bounds(p).empty());
  p.c.w = 0.5;
  p.slice_offset = 1.2;
  EXPECT_TRUE(bounds(p).empty());
  p.bound = 0;
  EXPECT_TRUE(bounds(p).empty());
}

TEST(JuliaDistance, IsZeroInsideAndALowerBoundOutside) {
  // c = 0: the unit ball.
  Parameters p;
  const Slice s = slice(p);
  std::mt19937 random(17);
  std::uniform_real_distribution<double> coordinate(-2, 2);
  for (int i = 0; i < 5000; ++i) {
    const glm::dvec3 q(coordinate(random), coordinate(random), coordinate(random));
    const double r = glm::length(q), estimate = distance_estimate(p, s, q);
    if (r < 0.999) {
      EXPECT_EQ(estimate, 0) << r;
    }
    if (r > 1.001) {
      EXPECT_GT(estimate, 0) << r;
      EXPECT_LE(estimate, r - 1) << r;
      EXPECT_GE(estimate, 0.25 * (r - 1)) << r;
    }
  }
}

TEST(JuliaDistance, OfConnectedSetsReachesNoPointInside) {
  // Steps of the estimate from points outside, in random directions, never end inside.
  std::mt19937 random(19);
  std::uniform_real_distribution<double> coordinate(-1.4, 1.4);
  std::normal_distribution<double> normal;
  for (const auto& preset : presets()) {
    const auto& p = preset.parameters;
    const Slice s = slice(p);
    Parameters longer = p;  // a point near the set that takes more iterations to escape is not inside
    longer.iterations = 1000;
    int outside = 0;
    for (int i = 0; i < 3000; ++i) {
      const glm::dvec3 q(coordinate(random), coordinate(random), coordinate(random));
      const double estimate = distance_estimate(p, s, q);
      if (estimate <= 0) continue;
      ++outside;
      const glm::dvec3 step = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
      EXPECT_GT(distance_estimate(longer, s, q + 0.98 * estimate * step), 0) << preset.name;
    }
    EXPECT_GT(outside, 1000) << preset.name;
  }
}

}  // namespace
}  // namespace telesplat::julia
