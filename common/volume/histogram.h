// Frequencies of a volume's values, for people who choose a transfer function. Sent as a fact of the session.
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

/// Numbers of voxels in evenly spaced bins from lo to hi.
struct Histogram {
  double lo = 0, hi = 1;
  std::vector<uint64_t> counts;
  bool operator==(const Histogram&) const = default;
};

/// Sums the voxels of all levels into at most `bins` bins. Precondition: one count a level.
Histogram histogram_of(std::span<const uint64_t> level_counts, const Levels& levels, int bins = 256);

/// Writes "LO:HI:COUNT,COUNT,..."; histogram_from_text reads the same histogram from it.
std::string to_text(const Histogram& histogram);
/// Error: another form, no bin or more than kMostBins, an invalid range.
Result<Histogram> histogram_from_text(std::string_view text);

}  // namespace telesplat::volume
