// From the values of a volume to levels, and one time step in memory: the levels of its slices, ready to be classified.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/volume/levels.h"
#include "common/volume/session.h"
#include "common/volume/transfer/function.h"
#include "common/volume/voxels.h"
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

/// Immutable once made. Its slices are [begin, end); it holds one more on both sides, where the grid has them, for
/// gradients.
class VolumeSlices {
 public:
  /// Precondition: volume.size == session.grid.size.
  VolumeSlices(const Volume& volume, const volume::Session& session, int begin, int end);

  int begin() const { return begin_; }
  int end() const { return end_; }
  size_t bytes() const;

  /// Voxels whose level is in `wanted`, of slices [k_begin, k_end), which are of this step. A normal is minus the
  /// gradient's direction in room space (towards lower values), by central differences, at the grid's faces by
  /// differences to one side; kNoNormal where the value changes by less than a 512th of all levels over Grid::unit_m().
  volume::Voxels voxels(int k_begin, int k_end, const volume::LevelSet& wanted) const;
  /// The level of a voxel of this step's own slices, or of one beside them.
  double level(int i, int j, int k) const;
  /// How many those are, of each of this step's slices.
  std::vector<uint32_t> weights(const volume::LevelSet& wanted) const;

 private:
  template <class Level>
  void count(const std::vector<Level>& levels);
  template <class Level>
  void classify(const std::vector<Level>& levels, int k, const std::vector<uint8_t>& wanted, volume::Voxels& out,
                size_t row, size_t at) const;
  uint32_t weight(int k, const volume::LevelSet& wanted) const;

  std::array<int, 3> size_;
  int begin_, end_, stored_begin_, stored_end_, level_count_;
  bool lit_;
  glm::mat3 outward_;  // from differences by index to minus the gradient in room space, times Grid::unit_m()
  LevelArray levels_;
  std::vector<uint32_t> counts_;  // voxels of every level, a slice after the other
};

}  // namespace telesplat::data
