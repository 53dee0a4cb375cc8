// Pictures that were drawn with half as many pixels a side, at their full size.
#pragma once

#include "common/splat/cpu_splatter.h"

namespace telesplat::splat {

/// Rows [first, last) of `to`: bilinear between the pixels of `half`, whose centres lie at (2 i + 1, 2 j + 1); beyond
/// the outermost centres the outermost pixels go on. Channels are 2 of 255 off at most. Depths are those of the pixel
/// of `half` that covers a pixel. Preconditions: half has half of to's size, rounded up, and depths if `to` has.
void double_rows(const FrameTarget& half, const FrameTarget& to, int first, int last);

}  // namespace telesplat::splat
