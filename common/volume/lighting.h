// Light on voxels, the same for samplers and for the reference: image/shading.h's lights, with the head light shining
// from the eye on the centre of the volume, so that slice images do not depend on where the head is turned to.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "common/volume/grid.h"

namespace telesplat::volume {

/// Intensity, 0 to 1, by normal (image::encode_normal16), 65536 entries; that of kNoNormal is what a surface that faces
/// the eye would have.
std::vector<float> normal_intensities(const Grid& grid, const glm::dvec3& eye_room);

}  // namespace telesplat::volume
