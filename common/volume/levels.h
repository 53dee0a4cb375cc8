// Voxel values as sent: one of at most 4096 levels, evenly spaced over the volume's range and independent of the
// transfer function, so that a voxel need not be sent again when the transfer function changes. 8-bit data keep their
// values, and so do 12-bit scanners'.
#pragma once

#include <cmath>
#include <cstdint>

namespace telesplat::volume {

inline constexpr int kMaxLevels = 4096;

struct Levels {
  double lo = 0, step = 1;  ///< level l represents the value lo + l * step
  int count = 256;
  bool operator==(const Levels&) const = default;

  double value(int level) const { return lo + level * step; }
  /// The nearest level. Values outside the range get the nearest end's, NaN gets lo's.
  uint16_t level(double value) const {
    const double l = std::floor((value - lo) / step + 0.5);
    return !(l > 0) ? uint16_t(0) : l >= count - 1 ? uint16_t(count - 1) : uint16_t(l);
  }
};

}  // namespace telesplat::volume
