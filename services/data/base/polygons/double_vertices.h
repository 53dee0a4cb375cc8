// Doubles vertices that must look different in different triangles.
#pragma once

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Doubles vertices until each has one look in all its triangles; a copy gets all of its vertex's values. fits(vertex,
/// corner): true if the vertex has the look that this corner of the indices wants. take(vertex, corner): gives it that
/// look, before the next call of fits(); a new vertex is the mesh's last one. Preconditions: every index is below the
/// number of vertices; the mesh has no copies.
template <class Fits, class Take>
void double_vertices(Mesh& mesh, const Fits& fits, const Take& take) {
  constexpr uint32_t kNone = ~uint32_t{0};
  constexpr int kMostSteps = 64;  // through a vertex's copies: a vertex with a million looks must not cost hours
  std::vector<bool> taken(mesh.positions.size(), false);
  std::vector<uint32_t> next_copy(mesh.positions.size(), kNone);  // the latest copy first
  for (size_t corner = 0; corner < mesh.indices.size(); ++corner) {
    const uint32_t vertex = mesh.indices[corner];
    uint32_t found = vertex;
    if (!taken[vertex]) {
      taken[vertex] = true;
      take(vertex, corner);
      continue;
    }
    int steps = 0;
    while (found != kNone && steps < kMostSteps && !fits(found, corner)) found = next_copy[found], ++steps;
    if (found == kNone || steps == kMostSteps) {
      found = uint32_t(mesh.positions.size());
      mesh.positions.push_back(glm::dvec3(mesh.positions[vertex]));
      if (!mesh.normals.empty()) mesh.normals.push_back(glm::vec3(mesh.normals[vertex]));
      if (!mesh.colours.empty()) mesh.colours.push_back(uint32_t(mesh.colours[vertex]));
      if (!mesh.scalars.empty() && !mesh.scalars_of_faces) mesh.scalars.push_back(float(mesh.scalars[vertex]));
      mesh.copy_of.push_back(vertex);
      next_copy.push_back(next_copy[vertex]);
      next_copy[vertex] = found;
      take(found, corner);
    }
    mesh.indices[corner] = found;
  }
}

}  // namespace telesplat::data
