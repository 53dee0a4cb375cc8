// Size and orientation of a data set in the room.
#pragma once

#include <glm/mat3x3.hpp>
#include <string>

#include "common/core/result.h"
#include "common/scene/placement.h"

namespace telesplat::data {

struct PlacementOptions {
  double room_size_m = 0.8;  ///< the largest extent of the data set's box in room space
  /// x, y, z, -x, -y, -z: the data axis that points up; auto: z for terrains, volumes and other medical data, else y.
  std::string up = "auto";
  /// For meshes without normals: an edge is sharp if its triangles meet at this angle or more; 180: vertices have one
  /// normal each.
  double crease_deg = 40;
};

/// Returns the rotation (determinant +1) that turns data axis `up` to +y. A patient stands the same way in LPS and RAS
/// axes: RAS is turned by 180 degrees about z. Error unless `up` is x, y, z, -x, -y or -z.
Result<glm::dmat3> rotation_for_up(const std::string& up, scene::Space space = scene::Space::kPlain);

}  // namespace telesplat::data
