// All programs of the GL renderer, from the sources in shaders/.
#pragma once

#include <array>

#include "client/viewer/render/gl/program.h"
#include "common/splat/finish.h"
#include "common/splat/kernel_traits.h"

namespace telesplat::viewer {

/// A whole-frame pass: the last one of a frame writes the output, the others pairs.
struct FramePass {
  gl::Program to_pairs, to_output;
};

/// What draws the splats of one kernel. Passes::kKeys needs `splat` alone.
struct KernelPrograms {
  gl::Program splat;  ///< writes keys, or (Passes::kSums) the depth of opaque splats
  gl::Program sum;    ///< adds up what is visible
  FramePass resolve;  ///< shades the sums
};

struct Programs {
  std::array<KernelPrograms, splat::kKernels.size()> kernels;  ///< by splat::Kernel
  FramePass keys;                                              ///< shades keys
  FramePass fill_pin_holes, fill_all, smooth, antialias;       ///< the finish; splat::Gaps

  const FramePass& fill(splat::Gaps gaps) const { return gaps == splat::Gaps::kAll ? fill_all : fill_pin_holes; }
  const KernelPrograms& of(splat::Kernel kernel) const { return kernels[static_cast<size_t>(kernel)]; }

  /// Fails with the compiler's words.
  static Result<Programs> make();
};

}  // namespace telesplat::viewer
