// Light on voxels, the same for samplers and for the reference: the lights of image/shading.h, with the head light
// shining from the eye to the volume's centre, so that slice images do not depend on the head's orientation.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "common/volume/grid.h"

namespace telesplat::volume {

/// Intensity, 0 to 1, by normal (image::encode_normal16), 65536 entries; kNoNormal has the intensity of a surface that
/// faces the eye.
std::vector<float> normal_intensities(const Grid& grid, const glm::dvec3& eye_room);

}  // namespace telesplat::volume
