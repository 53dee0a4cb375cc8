// Where in the room a data set is shown, and which way up.
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
  /// Meshes without normals: edges under this angle or more between two triangles are sharp; 180: vertices have one
  /// normal each.
  double crease_deg = 40;
};

/// The rotation (determinant +1) that turns data axis `up` to +y. A patient stands in one way, whether the axes are LPS
/// or RAS: these are turned by 180 degrees about z. Error unless `up` is x, y, z, -x, -y or -z.
Result<glm::dmat3> rotation_for_up(const std::string& up, scene::Space space = scene::Space::kPlain);

}  // namespace telesplat::data
