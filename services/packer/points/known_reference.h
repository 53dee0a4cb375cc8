// What the model shows where a tile was sampled, from whoever has rendered it already.
#pragma once

#include <span>

#include "common/image/pixel_mask.h"

namespace telesplat::packer {

struct KnownReference {
  const image::PixelMask& cast;      ///< of the tile's size: no other pixel of it is covered
  std::span<const float> nearest_m;  ///< of its frame: render_reference_depth(), but for samples of the frame itself
};

}  // namespace telesplat::packer
