// Polygons of any shape become triangles that cover them once.
#include "services/data/base/polygons/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <random>

namespace telesplat::data {
namespace {

using Corners = std::vector<glm::dvec2>;

// Puts the polygon into a plane that is parallel to no axis.
glm::dvec3 placed(glm::dvec2 p) {
  return glm::dvec3(5, -3, 100) + p.x * glm::dvec3(0.6, 0.8, 0) + p.y * glm::dvec3(0.48, -0.36, 0.8);
}

double area_of(const Corners& corners) {
  double twice = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec2 a = corners[i], b = corners[(i + 1) % corners.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return twice / 2;
}

std::vector<uint32_t> cut(const Corners& corners) {
  std::vector<glm::dvec3> positions;
  std::vector<uint32_t> ring, indices;
  for (const glm::dvec2 p : corners) ring.push_back(uint32_t(positions.size())), positions.push_back(placed(p));
  cut_polygon(ring, positions, indices);
  return indices;
}

// The sum of the triangles' areas, each without its sign, is the polygon's area only if no triangle lies outside or
// over another one.
void expect_covered_once(const Corners& corners) {
  const std::vector<uint32_t> indices = cut(corners);
  ASSERT_EQ(indices.size(), 3 * (corners.size() - 2));
  const glm::dvec3 normal = glm::cross(glm::dvec3(0.6, 0.8, 0), glm::dvec3(0.48, -0.36, 0.8));
  double sum = 0, turned = 0;
  for (size_t t = 0; t < indices.size(); t += 3) {
    const glm::dvec3 a = placed(corners[indices[t]]), b = placed(corners[indices[t + 1]]),
                     c = placed(corners[indices[t + 2]]);
    const double area = glm::dot(glm::cross(b - a, c - a), normal) / 2;
    sum += std::abs(area), turned += std::min(area, 0.0);
  }
  const double right = std::abs(area_of(corners));
  EXPECT_NEAR(sum, right, 1e-9 * right);
  EXPECT_NEAR(turned, area_of(corners) > 0 ? 0 : -right, 1e-9 * right);
}

Corners turned_around(Corners corners) {
  std::reverse(corners.begin(), corners.end());
  return corners;
}

const Corners kU = {{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 0.75}, {1, 0.75}, {1, 2}, {0, 2}};

TEST(Polygon, CutsConcavePolygonsFromEachFirstCornerAndBothWaysRound) {
  Corners corners = kU;
  for (size_t i = 0; i < corners.size(); ++i) {
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    expect_covered_once(corners);
    expect_covered_once(turned_around(corners));
  }
}

TEST(Polygon, KeepsTheFanOfConvexPolygons) {
  EXPECT_EQ(cut({{0, 0}, {1, 0}, {2, 1}, {1, 2}, {0, 1}}), (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4}));
}

TEST(Polygon, CutsAConcaveFourCorneredPolygonAlongItsInnerDiagonal) {
  expect_covered_once({{0, 0}, {4, 0}, {1, 1}, {0, 4}});
  expect_covered_once({{4, 0}, {1, 1}, {0, 4}, {0, 0}});
}

TEST(Polygon, CutsCornersInOneLine) {
  expect_covered_once({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 1}});
}

TEST(Polygon, CutsHolesThatADoubleEdgeJoins) {
  expect_covered_once({{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}});
  // Two holes, both joined to the same corner.
  expect_covered_once({{0, 0},
                       {2, 1},
                       {2, 3},
                       {4, 3},
                       {4, 1},
                       {2, 1},
                       {0, 0},
                       {9, 0},
                       {9, 9},
                       {0, 9},
                       {0, 0},
                       {1, 5},
                       {1, 8},
                       {5, 8},
                       {5, 5},
                       {1, 5}});
}

TEST(Polygon, CutsRepeatedCornersAndSpikes) {
  expect_covered_once({{0, 0}, {0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
  expect_covered_once({{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 1}, {1.5, 5}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
}

TEST(Polygon, CutsRandomStarsAndSpirals) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> radius(0.2, 1);
  for (const int n : {5, 8, 13, 50, 400, 3000}) {
    Corners star, spiral;
    for (int i = 0; i < n; ++i)
      star.push_back(radius(random) * glm::dvec2(std::cos(i * 6.283 / n), std::sin(i * 6.283 / n)));
    expect_covered_once(star);
    for (int i = 0; i < n; ++i) {
      const double turn = 0.2 * i + 1;
      spiral.push_back(turn * glm::dvec2(std::cos(turn), std::sin(turn)));
    }
    for (int i = n - 1; i >= 0; --i) {
      const double turn = 0.2 * i + 1;
      spiral.push_back((turn + 1.5) * glm::dvec2(std::cos(turn), std::sin(turn)));
    }
    expect_covered_once(spiral);
  }
}

TEST(Polygon, CutsACombOfHundredThousandCornersInSeconds) {
  Corners comb;
  for (int i = 0; i < 25000; ++i)
    for (const glm::dvec2 p : {glm::dvec2(2, 0), {2, 9}, {1, 9}, {1, 0}}) comb.push_back({-2 * i + p.x, p.y});
  comb.push_back({-50000, -1}), comb.push_back({2, -1});
  const auto start = std::chrono::steady_clock::now();
  expect_covered_once(turned_around(comb));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Polygon, EndsOnAMillionCornersThatCrossEachOther) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> somewhere(0, 1);
  Corners corners(1'000'000);
  for (glm::dvec2& p : corners) p = {somewhere(random), somewhere(random)};
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(cut(corners).size(), 3 * (corners.size() - 2));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST(Polygon, GivesTrianglesWhereCornersAreNoNumbersOrHaveNoArea) {
  const double nan = std::nan("");
  EXPECT_EQ(cut({{0, 0}, {1, 0}, {nan, 1}, {0, 1}}).size(), 6u);
  EXPECT_EQ(cut({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {1.5, 0}}).size(), 9u);
  EXPECT_EQ(cut({{0, 0}, {1, 0}}).size(), 0u);
}

}  // namespace
}  // namespace telesplat::data
