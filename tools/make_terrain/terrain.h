// Made-up land for demos: a caldera with a lake, coloured by height and slope.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::terrain {

inline constexpr uint64_t kMinTriangles = 2, kMaxTriangles = uint64_t{1} << 31;

struct Terrain {
  std::vector<glm::vec3> positions;  ///< metres; x east, y north, z up; the land begins at (0, 0)
  std::vector<uint32_t> colours;     ///< 0x00RRGGBB, one a vertex
  std::vector<uint32_t> indices;     ///< three a triangle, counter-clockwise from above
};

/// Makes the land of this seed with exactly this many triangles, on a regular grid; its last row may be cut short. The
/// large forms do not depend on the number of triangles. The same arguments make the same land on any number of
/// threads. `progress`: fraction done, called on this thread. Precondition: kMinTriangles <= triangles <=
/// kMaxTriangles.
Terrain make_terrain(uint64_t triangles, uint64_t seed, const std::function<void(double fraction)>& progress = {});

/// Binary little-endian PLY with float positions and uchar colours. The file appears whole or not at all. Errors name
/// the path.
Status write_ply(const Terrain& terrain, const std::string& path,
                 const std::function<void(double fraction)>& progress = {});

}  // namespace telesplat::terrain
