#include "services/data/base/mesh.h"

#include <fmt/format.h>

#include <cmath>

namespace telesplat::data {

Status validate_mesh(const Mesh& mesh, const std::string& name) {
  const size_t vertices = mesh.positions.size(), triangles = mesh.indices.size() / 3;
  CHECK(mesh.indices.size() % 3 == 0);
  CHECK(mesh.normals.empty() || mesh.normals.size() == vertices);
  CHECK(mesh.colours.empty() || mesh.colours.size() == vertices);
  CHECK(mesh.scalars.empty() || mesh.scalars.size() == (mesh.scalars_of_faces ? triangles : vertices));
  if (triangles == 0) return Error{fmt::format("{}: holds no triangles ({} vertices)", name, vertices)};
  if (triangles > kMaxTriangles)
    return Error{fmt::format("{}: {} triangles, the limit is {}", name, triangles, kMaxTriangles)};
  if (vertices > kMaxVertices)
    return Error{fmt::format("{}: {} vertices, the limit is {}", name, vertices, kMaxVertices)};
  uint32_t largest = 0;
  for (uint32_t i : mesh.indices) largest = std::max(largest, i);
  if (largest >= vertices) {
    size_t at = 0;
    while (mesh.indices[at] < vertices) ++at;
    if (mesh.indices[at] == ~uint32_t{0})
      return Error{fmt::format("{}: triangle {} names a vertex that is not one of the {}", name, at / 3, vertices)};
    return Error{
        fmt::format("{}: triangle {} names vertex {}, there are {}", name, at / 3, mesh.indices[at], vertices)};
  }
  for (size_t i = 0; i < vertices; ++i) {
    const glm::dvec3& p = mesh.positions[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      return Error{fmt::format("{}: vertex {} is not finite: ({}, {}, {})", name, i, p.x, p.y, p.z)};
  }
  return ok_status();
}

}  // namespace telesplat::data
