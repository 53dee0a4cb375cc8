// All programs of the GL renderer, from the sources in shaders/.
#pragma once

#include "common/gl/program.h"

namespace telesplat::viewer {

struct Programs {
  gl::Program square, disc, ellipse;
  gl::Program ewa_visibility, ewa_sum;
  /// A whole-frame pass: the last one of a frame writes the output, the others pairs.
  struct Pass {
    gl::Program to_pairs, to_output;
  };
  Pass keys, ewa;                ///< shading of what splatting left: keys, or sums
  Pass fill, smooth, antialias;  ///< the finish

  /// Fails with the compiler's words.
  static Result<Programs> make();
};

}  // namespace telesplat::viewer
