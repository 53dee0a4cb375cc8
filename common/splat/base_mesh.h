// The coarse form of the whole data set, as triangles: pictures show it where points leave pixels empty (backdrop.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "common/geometry/box.h"
#include "common/geometry/mesh_chunk.h"

namespace telesplat::splat {

/// Some triangles, near each other. Positions in the room, metres; unit normals; albedo 0x00RRGGBB.
struct BasePart {
  static constexpr size_t kMostTriangles = 4096;

  geometry::Box box_room;
  std::vector<glm::vec3> positions, normals;
  std::vector<uint32_t> colours;
  std::vector<uint16_t> indices;  ///< three a triangle, each below positions.size()
  std::vector<glm::vec4> planes;  ///< plane of each triangle: unit normal, and its product with points of the plane
  float error_m = 0;              ///< how far the surface may lie from these triangles, about
};

/// Finds the planes of a part that has all else. A triangle without area gets a normal of 0.
void find_planes(BasePart& part);

/// Takes a chunk apart. Precondition: its colours are no scalars, and it has at most kMostTriangles triangles and three
/// vertices for each.
BasePart base_part(const geometry::MeshChunkView& chunk);

struct BaseMesh {
  std::vector<std::shared_ptr<const BasePart>> parts;
  std::vector<std::vector<uint64_t>> hidden;  ///< a part's triangles that are not drawn, a bit each; empty: all are
  size_t triangles = 0;
  uint64_t number = 0;  ///< another mesh has another one
};

}  // namespace telesplat::splat
