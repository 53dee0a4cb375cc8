// The parts that a surface consists of, and its chunks.
#pragma once

#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "tools/lab/simulation/scenes/surface.h"

namespace telesplat::simulation {

/// The points p of a box with square . (d * d) + linear . d = constant, d = p - centre: room space, metres. Where pitch
/// is not 0 these are slats: of every `pitch` along x, from the box's edge on, the first `width`.
struct SurfacePart {
  glm::dvec3 centre, square, linear;
  double constant = 0;
  geometry::Box box_room;
  uint32_t colours[2] = {};  ///< 0x00RRGGBB, in turn, in cubes of a checkerboard
  size_t chunk = 0;
  double pitch = 0, width = 0;
};

struct SurfaceParts {
  std::vector<SurfacePart> parts;
  std::vector<geometry::ChunkInfo> chunks;    ///< index = id; the last one is the root
  std::vector<std::vector<std::byte>> bytes;  ///< chunks, coded
  uint64_t triangles = 0;
  geometry::Box box_room;
};

/// Made once, then the same.
const SurfaceParts& parts_of(Surface surface);

}  // namespace telesplat::simulation
