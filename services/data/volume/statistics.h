// From a volume's values to levels, and what is said of the values.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/volume/levels.h"
#include "common/volume/transfer/function.h"
#include "services/data/base/volume.h"

namespace telesplat::data {

/// Levels for values from lo to hi, as this volume stores them. 8-bit data keep all their 256 values, 16-bit data
/// theirs where hi and lo are at most 4095 apart; others get 4096 levels from lo to hi. Error: values beyond 1e30, a
/// scale of 0.
Result<volume::Levels> choose_levels(const Volume& volume, double lo, double hi);

/// The level of every voxel of the slices [k_begin, k_end), one byte each if there are at most 256 of them, else two.
struct LevelArray {
  std::vector<uint8_t> narrow;
  std::vector<uint16_t> wide;
};
LevelArray to_levels(const Volume& volume, const volume::Levels& levels, int k_begin, int k_end);

/// Voxels of every level, of all slices.
std::vector<uint64_t> count_levels(const Volume& volume, const volume::Levels& levels);

/// lo, hi as given. Background is what lies within 4 % of the range around the most frequent level; typical_lo and
/// typical_hi are the percentiles 2 and 99.5 of what is left. (If that is less than 0.5 % of the voxels: of all but the
/// most frequent level.)
volume::ValueRange describe_values(const std::vector<uint64_t>& counts, const volume::Levels& levels, double lo,
                                   double hi, bool hounsfield);

}  // namespace telesplat::data
