// Verification after a run: displayed frames against direct rendering of the data at the same pose (docs/quality.md).
#pragma once

#include <functional>
#include <string>

#include "common/core/result.h"
#include "common/image/shading.h"
#include "tools/telesplat/scene/direct_scene.h"

namespace telesplat::launcher {

struct VerifyOptions {
  image::ShadingParameters shading;  ///< as the frames were displayed with
  int samples = 16;                  ///< rays a pixel of the reference: image::validate_samples
};

/// Compares every spooled frame of `run_directory` that is marked for verification with a direct rendering of the
/// scene in the frame's epoch, and with the frame before it where that is among them; writes quality.csv, comparison
/// pictures (reference | displayed | difference) of the worst, the median and the last view into images/, fills
/// "quality" in summary.json, and deletes the spooled frames. progress(done, of) is called after each view.
/// should_stop() ends it early; what was compared so far counts.
Status verify_run(const std::string& run_directory, DirectScene& scene, const VerifyOptions& options,
                  const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& should_stop);

}  // namespace telesplat::launcher
