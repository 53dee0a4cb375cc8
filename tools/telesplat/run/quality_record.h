// What verification found, as quality.csv and as "quality" of summary.json (docs/metrics.md).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/image/measures/quality.h"
#include "common/image/measures/temporal.h"

namespace telesplat::launcher {

/// One displayed frame against its reference, and against the frame before it.
struct VerifiedView {
  uint64_t frame = 0;
  double t_s = 0;
  int samples = 1;   ///< rays a pixel of the reference
  uint32_t eye = 0;  ///< 1: the left eye's picture, 2: the right one's, 0: one for both
  image::Quality quality;
  double flip = 0;  ///< mean over the pixels that count
  /// Where the frame before it was compared too.
  struct Change {
    double since_s = 0;  ///< from that frame to this one
    image::Unsteadiness unsteadiness;
    std::optional<image::HoleFates> holes;  ///< of surfaces, within an epoch
  };
  std::optional<Change> change;
};

/// A row a view; what was not measured is empty.
std::string quality_csv(const std::vector<VerifiedView>& views);

/// Distributions over the views that show the data set; null where nothing was measured.
nlohmann::ordered_json quality_json(const std::vector<VerifiedView>& views);

/// How long a hole lasts on average, in ms: holes that exist, over holes that close in a second (Little 1961). Nothing
/// where none closed.
std::optional<double> hole_lifetime_ms(const std::vector<VerifiedView>& views);

}  // namespace telesplat::launcher
