// A tile as a sampler sent it, decoded.
#pragma once

#include "common/image/depth_image.h"
#include "services/packer/points/frame_part.h"

namespace telesplat::packer {

struct SampledTile : FramePart {
  image::DepthImage image;  ///< canonical, of rect's size
};

}  // namespace telesplat::packer
