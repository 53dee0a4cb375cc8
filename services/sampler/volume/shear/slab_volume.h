// What a sampler holds of one time step, arranged so that the slices of any principal axis can be gone through in
// either direction.
#pragma once

#include <mutex>

#include "services/sampler/volume/shear/rows.h"

namespace telesplat::sampler {

/// Voxels of the slices [k_begin, k_end): a slab and a slice on both sides. Immutable.
class SlabVolume {
 public:
  SlabVolume(const volume::Grid& grid, volume::Voxels voxels) : grid_(grid), voxels_(std::move(voxels)) {}

  const volume::Grid& grid() const { return grid_; }
  const volume::Voxels& voxels() const { return voxels_; }
  /// Memory, with the arrangement of every axis.
  size_t bytes() const;
  /// Made when a frame first needs it, once; safe to ask for from several threads. axis: the principal one.
  const ShearRows& rows(int axis) const;

 private:
  volume::Grid grid_;
  volume::Voxels voxels_;
  mutable std::once_flag made_[3];
  mutable ShearRows rows_[3];
};

}  // namespace telesplat::sampler
