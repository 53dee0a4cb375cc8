// Makes the surfels of triangles: means of their surface in the cells of a grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/geometry/mesh_chunk.h"

namespace telesplat::data {

struct Surfels {
  float spacing_m = 0;               ///< side of the cells
  std::vector<glm::vec3> positions;  ///< room space, metres
  std::vector<uint32_t> normals;     ///< image/normal.h: encode_normal32
  std::vector<uint32_t> colours;     ///< 0x00RRGGBB; of chunks with scalars: the bits of floats, NaN: none
};

/// Returns about `most` surfels: one for each cell of a grid that the surface meets, and more where it faces several
/// ways, so that both sides of a thin wall keep theirs. Position, normal, colour or scalar are means by area. The same
/// chunks give the same surfels. Precondition: most >= 1; all chunks hold scalars, or none does.
Surfels make_surfels(std::span<const geometry::MeshChunkView> chunks, const geometry::Box& box_room, size_t most);

}  // namespace telesplat::data
