#include "services/data/base/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/data/base/polygons/double_vertices.h"

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

bool drop_not_finite(Mesh& mesh, const std::string& name) {
  const auto bad = [&](const glm::dvec3& p) {
    return !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z);
  };
  const size_t vertices = mesh.positions.size(), triangles = mesh.indices.size() / 3;
  if (std::any_of(mesh.indices.begin(), mesh.indices.end(), [&](uint32_t i) { return i >= vertices; })) return false;
  if (std::none_of(mesh.positions.begin(), mesh.positions.end(), bad)) return true;
  const auto keeps = [&](size_t t) {
    return !std::any_of(&mesh.indices[3 * t], &mesh.indices[3 * t] + 3,
                        [&](uint32_t i) { return bad(mesh.positions[i]); });
  };
  size_t kept = 0;
  for (size_t t = 0; t < triangles; ++t) kept += keeps(t);
  if (kept == 0) return false;
  kept = 0;
  for (size_t t = 0; t < triangles; ++t) {
    if (!keeps(t)) continue;
    std::copy_n(&mesh.indices[3 * t], 3, &mesh.indices[3 * kept]);
    if (mesh.scalars_of_faces && !mesh.scalars.empty()) mesh.scalars[kept] = mesh.scalars[t];
    ++kept;
  }
  mesh.indices.resize(3 * kept);
  if (mesh.scalars_of_faces && !mesh.scalars.empty()) mesh.scalars.resize(kept);
  for (glm::dvec3& p : mesh.positions)
    if (bad(p)) p = glm::dvec3(0);
  if (kept < triangles)
    mesh.notes.push_back(fmt::format("{}: {} of {} triangles are left out: a coordinate of theirs is no finite number",
                                     name, triangles - kept, triangles));
  return true;
}

void colour_faces(Mesh& mesh, std::span<const uint32_t> of_triangles) {
  CHECK(of_triangles.size() == mesh.indices.size() / 3);
  mesh.colours.resize(mesh.positions.size(), kNeutralAlbedo);
  const std::vector<uint32_t> own = mesh.colours;
  const auto colour_of = [&](size_t corner) {
    const uint32_t colour = of_triangles[corner / 3];
    return colour != kNoColour ? colour : own[mesh.indices[corner]];
  };
  double_vertices(
      mesh, [&](uint32_t vertex, size_t corner) { return mesh.colours[vertex] == colour_of(corner); },
      [&](uint32_t vertex, size_t corner) { mesh.colours[vertex] = colour_of(corner); });
}

}  // namespace telesplat::data
