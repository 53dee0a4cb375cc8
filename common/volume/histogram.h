// How often values are in a volume, for people who choose a transfer function. It travels as a fact of the session.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/volume/levels.h"

namespace telesplat::volume {

inline constexpr int kMostBins = 512;
inline constexpr const char* kHistogramFact = "histogram";

/// Voxels of evenly spaced bins from lo to hi.
struct Histogram {
  double lo = 0, hi = 1;
  std::vector<uint64_t> counts;
  bool operator==(const Histogram&) const = default;
};

/// Of the voxels of every level, in at most `bins` bins over all levels. Precondition: as many counts as levels.
Histogram histogram_of(std::span<const uint64_t> level_counts, const Levels& levels, int bins = 256);

/// "LO:HI:COUNT,COUNT,..."; histogram_from_text of it gives the same again.
std::string to_text(const Histogram& histogram);
/// Error: no such text, no bin or more than kMostBins, a range that is none.
Result<Histogram> histogram_from_text(std::string_view text);

}  // namespace telesplat::volume
