// Depth images of all kinds, for properties of the codec.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/depth_image.h"

namespace telesplat::test {

/// One image of each kind there is, small enough to try many: planes, terrains, noise; full, of all densities,
/// outlines, bands, patterns.
std::vector<image::DepthImage> codec_images(uint32_t seed);

}  // namespace telesplat::test
