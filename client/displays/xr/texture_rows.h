// Rows of pictures as textures have them, many pixels at a time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace telesplat::viewer {

/// 0xAARRGGBB to bytes R G B A.
void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out);

/// How depth is told to a headset: as a projection of near_m to far_m has it, 0 is near and 1 is far.
struct DepthRange {
  double near_m = 0.01, far_m = 100;
};
/// Half as many pixels on each axis, of each 2 x 2 the nearest one: what reprojection must not tear apart is in front.
/// above, below: two rows of 2 x pixels depths, metres; infinity: nothing.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out);
/// The same as shares of 65535.
void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out);

}  // namespace telesplat::viewer
