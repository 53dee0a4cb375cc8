// The pixels of a mask in an order that suits packets of rays.
#pragma once

#include <vector>

#include "common/image/pixel_mask.h"

namespace telesplat::sampler {

struct MaskedPixel {
  int16_t x, y;
  bool operator==(const MaskedPixel&) const = default;
};

/// All covered pixels of a mask, successive ones close together: the mask is walked in squares of 32 x 32 pixels, each
/// along a Z curve (G. Morton, 1966) down to blocks of 4 x 2, which are the packets of a full mask.
/// Precondition: sides of at most 32767 pixels.
std::vector<MaskedPixel> gather(const image::PixelMask& mask);

}  // namespace telesplat::sampler
