// All programs of the GL renderer, from the sources in shaders/.
#pragma once

#include <array>

#include "client/viewer/render/gl/program.h"
#include "common/splat/finish.h"
#include "common/splat/kernel_traits.h"

namespace telesplat::viewer {

/// A whole-frame pass: the last pass of a frame writes the output, the others write pairs.
struct FramePass {
  gl::Program to_pairs, to_output;
};

/// Programs that draw the splats of one kernel. Passes::kKeys needs only `splat`.
struct KernelPrograms {
  gl::Program splat;  ///< writes keys, or (Passes::kSums) the depth of opaque splats
  gl::Program sum;    ///< adds up visible splats
  FramePass resolve;  ///< shades the sums
};

struct Programs {
  std::array<KernelPrograms, splat::kKernels.size()> kernels;  ///< by splat::Kernel
  FramePass keys;                                              ///< shades keys
  FramePass fill_pin_holes, fill_all, smooth, antialias;       ///< the finish; splat::Gaps

  const FramePass& fill(splat::Gaps gaps) const { return gaps == splat::Gaps::kAll ? fill_all : fill_pin_holes; }
  const KernelPrograms& of(splat::Kernel kernel) const { return kernels[static_cast<size_t>(kernel)]; }

  /// Error: the compiler's text.
  static Result<Programs> make();
};

}  // namespace telesplat::viewer
