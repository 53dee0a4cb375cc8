// A tile as a sampler sent it, decoded.
#pragma once

#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"
#include "services/packer/points/frame_part.h"

namespace telesplat::packer {

struct SampledTile : FramePart {
  image::DepthImage image;  ///< canonical, of rect's size
  /// Of rays finer than a view's: those that met nothing, of rect's size; else empty.
  image::PixelMask missed{};
};

}  // namespace telesplat::packer
