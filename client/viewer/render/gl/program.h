// The splatting program: vertex and fragment shader.
#pragma once

#include <cstdint>

#include "common/core/result.h"

namespace telesplat::viewer {

/// What one draw needs, as the shaders see it (std430).
struct DrawRecord {
  float row_x[4], row_y[4], row_w[4];  ///< splat::LeafTransform
  uint32_t word;                       ///< of the points, in their arena
  uint32_t count;
  int32_t side;       ///< pixels
  float diameter;     ///< disc: pixels; square: 0
  float bias_growth;  ///< splat::splat_bias_growth
  int32_t sub_steps;  ///< 2^sub_bits of the splat's shape
  int32_t unused[2];
};
static_assert(sizeof(DrawRecord) == 80);

/// Bindings: storage buffers 0 = points (uint[]), 1 = draws (DrawRecord[]), 2 = intensities (65536 bytes in uint[]); attribute 0 =
/// number of the draw; uniforms below. Colour 0: uint 0xAARRGGBB, colour 1: float depth in metres; depth: near / depth, larger is nearer.
struct SplatProgram {
  uint32_t program = 0;
  int32_t frame_size = -1;  ///< vec2: pixels, margin included
  int32_t margin = -1;      ///< float: pixels around the image, so that splats whose centre is outside are not lost
  int32_t near_m = -1;
};

/// Fails with the compiler's words.
Result<SplatProgram> make_splat_program();

}  // namespace telesplat::viewer
