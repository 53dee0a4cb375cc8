// Verification after a run: displayed frames against direct rendering of the data at the same pose (docs/quality.md).
#pragma once

#include <functional>
#include <string>

#include "common/core/result.h"
#include "common/image/shading.h"
#include "tools/telesplat/scene/direct_scene.h"

namespace telesplat::launcher {

/// Compares every spooled frame of `run_directory` that is marked for verification with a direct rendering of the
/// scene in the frame's epoch by the same shading; writes quality.csv, comparison pictures (reference | displayed |
/// difference) of the worst, the median and the last view into images/, fills "quality" in summary.json, and deletes
/// the spooled frames. progress(done, of) is called after each view. should_stop() ends it early; what was compared so
/// far counts.
Status verify_run(const std::string& run_directory, DirectScene& scene, const image::ShadingParameters& shading,
                  const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& should_stop);

}  // namespace telesplat::launcher
