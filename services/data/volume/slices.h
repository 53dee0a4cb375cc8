// Converts the values of a volume to levels, and holds one time step: the levels of its slices, ready to be classified.
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

/// Returns levels for values from lo to hi, as this volume stores them. 8-bit data keep all their 256 values, 16-bit
/// data theirs if hi and lo are at most 4095 apart; others get 4096 levels from lo to hi. Error: values beyond 1e30, a
/// scale of 0.
Result<volume::Levels> choose_levels(const Volume& volume, double lo, double hi);

/// Levels of all voxels of slices [k_begin, k_end): in `narrow` if there are at most 256 levels, else in `wide`.
struct LevelArray {
  std::vector<uint8_t> narrow;
  std::vector<uint16_t> wide;
};
LevelArray to_levels(const Volume& volume, const volume::Levels& levels, int k_begin, int k_end);

/// Counts the voxels of each level, over all slices.
std::vector<uint64_t> count_levels(const Volume& volume, const volume::Levels& levels);

/// Describes the distribution of values; lo, hi as given. Background are the levels within 4 % of the range around the
/// most frequent one; typical_lo and typical_hi are the percentiles 2 and 99.5 of the rest. (If the rest is less than
/// 0.5 % of the voxels, it is all but the most frequent level.)
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

  /// Returns the voxels whose level is in `wanted`, in slices [k_begin, k_end), which are this step's. A normal is
  /// minus the gradient's direction in room space (towards lower values), by central differences, at the grid's faces
  /// by one-sided ones; kNoNormal where the value changes by less than a 512th of all levels over Grid::unit_m().
  volume::Voxels voxels(int k_begin, int k_end, const volume::LevelSet& wanted) const;
  /// Returns the level of a voxel in this step's own slices, or in one beside them.
  double level(int i, int j, int k) const;
  /// Returns the number of wanted voxels in each of this step's slices.
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
  std::vector<uint32_t> counts_;  // voxels per level, one slice after the other
};

}  // namespace telesplat::data
