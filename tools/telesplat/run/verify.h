// Verifies a run: compares displayed frames with direct rendering of the data at the same pose (docs/quality.md).
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/measures/quality.h"
#include "common/image/measures/temporal.h"
#include "common/image/shading.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// One displayed frame against its reference, and against the frame before it.
struct VerifiedView {
  uint64_t frame = 0;
  double t_s = 0;
  int samples = 1;   ///< rays a pixel of the reference
  uint32_t eye = 0;  ///< 1: the left eye's picture, 2: the right one's, 0: one for both
  image::Quality quality;
  double flip = 0;  ///< mean over the pixels that count (quality.h)
  /// Change from the frame before it, if that was compared too.
  struct Change {
    double since_s = 0;  ///< from that frame to this one
    image::Unsteadiness unsteadiness;
    std::optional<image::HoleFates> holes;  ///< only for surfaces, within an epoch
  };
  std::optional<Change> change;
};

/// A row a view; empty cells were not measured.
std::string quality_csv(const std::vector<VerifiedView>& views);

/// Distributions over the views that show the data set; null without a measurement.
nlohmann::ordered_json quality_json(const std::vector<VerifiedView>& views);

/// Mean life of a hole, in ms: existing holes over holes that close in a second (Little 1961). Nothing if no hole
/// closed.
std::optional<double> hole_lifetime_ms(const std::vector<VerifiedView>& views);

struct VerifyOptions {
  image::ShadingParameters shading;  ///< as in the displayed frames
  int samples = 16;                  ///< rays a pixel of the reference: image::validate_samples
};

/// Compares every spooled frame of `run_directory` that is marked for verification with a direct rendering of the scene
/// in the frame's epoch, and with the frame before it if that is marked too; writes quality.csv, comparison pictures
/// (reference | displayed | difference) of the worst, the median and the last view into images/, fills "quality" in
/// summary.json, and deletes the spooled frames. Calls progress(done, of) after each view. should_stop() ends it early;
/// views compared so far count.
Status verify_run(const std::string& run_directory, DirectScene& scene, const VerifyOptions& options,
                  const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& should_stop);

}  // namespace telesplat::launcher
