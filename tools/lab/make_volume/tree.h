// A made-up CT scan: a potted Christmas tree with hollow glass balls, after the data set with which volume renderers
// have been compared for long (Kanitsar et al., "Christmas tree case study", IEEE Visualization 2002). Every value here
// is computed; none comes from their data.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/result.h"

namespace telesplat::made_volume {

inline constexpr int kMinSide = 16, kMaxSide = 1024;

/// A cube of side^3 values, x fastest, z up. Air 0 and noise, needles about 9000, wood 14000, soil 18000, earthenware
/// 30000, glass 40000, metal 60000.
struct Scan {
  int side = 0;
  std::vector<uint16_t> values;
};

/// The same seed makes the same tree. Precondition: side within the limits. progress: 0 to 1.
Scan make_tree(int side, uint64_t seed, const std::function<void(double)>& progress);

/// Writes .nrrd, .mha or .raw, by the ending; bits: 16, or 8 (the upper half of each value). Errors name the file.
Status write_scan(const Scan& scan, int bits, const std::string& path);

}  // namespace telesplat::made_volume
