// Corners of a square around a point.
#pragma once

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace telesplat::data {

/// Triangles of a square, by its corners.
inline constexpr uint32_t kSquare[6] = {0, 1, 2, 0, 2, 3};

/// Returns the corners of a square with this normal, of length 1, as places around its centre; half: of a side.
inline std::array<glm::vec3, 4> square_around(const glm::vec3& normal, float half) {
  const glm::vec3 aside = std::abs(normal.x) < 0.7f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 u = half * glm::normalize(glm::cross(normal, aside)), v = glm::cross(normal, u);
  return {-u - v, u - v, u + v, -u + v};
}

}  // namespace telesplat::data
