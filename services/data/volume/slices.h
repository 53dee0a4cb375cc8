// One time step of a volume in a data server's memory: the levels of its slices, ready to be classified.
#pragma once

#include <vector>

#include "common/volume/session.h"
#include "common/volume/voxels.h"
#include "services/data/volume/statistics.h"

namespace telesplat::data {

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
