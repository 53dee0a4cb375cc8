// Which part of a volume is served, and how.
#pragma once

#include <optional>
#include <string>

#include "services/data/base/volume_layout.h"

namespace telesplat::data {

struct VolumeOptions : VolumeLayout {
  std::string transfer;  ///< as volume::resolve_transfer takes it; empty: what fits
  bool lit = true;
  /// Steps of a series a second; nothing: all of them in a second, at most 12.5; 0: it does not play.
  std::optional<double> steps_per_s;
  std::string part;     ///< "1/2": the second of two parts; empty: all of it
  int cache_mb = 2048;  ///< for the steps of a series that are kept
};

}  // namespace telesplat::data
