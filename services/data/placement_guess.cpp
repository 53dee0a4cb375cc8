#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "services/data/placement.h"

namespace telesplat::data {
namespace {

// A surface over the plane of x and y: flat on the whole, and seen from one side.
bool is_height_field(const Mesh& mesh, const glm::dvec3& size) {
  if (!(size.z < 0.35 * size.x && size.z < 0.35 * size.y)) return false;
  glm::dvec3 sum(0);
  double area = 0;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const glm::dvec3 a = mesh.positions[mesh.indices[i]];
    const glm::dvec3 n = glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
    sum += n;
    area += glm::length(n);
  }
  const double length = glm::length(sum);
  return length >= 0.4 * area && std::abs(sum.z) >= 0.87 * length;
}

}  // namespace

std::string guess_up(const Mesh& mesh) {
  geometry::DBox box;
  for (uint32_t i : mesh.indices) box.extend(mesh.positions[i]);
  if (is_height_field(mesh, box.size())) return "z";
  return "y";
}

}  // namespace telesplat::data
