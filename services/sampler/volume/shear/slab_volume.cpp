#include "services/sampler/volume/shear/slab_volume.h"

namespace telesplat::sampler {

const ShearRows& SlabVolume::rows(int axis) const {
  std::call_once(made_[axis], [&] { rows_[axis] = arrange(grid_, voxels_, axis); });
  return rows_[axis];
}

size_t SlabVolume::bytes() const {
  const size_t held = size_t(voxels_.k_end - voxels_.k_begin);
  const auto& size = grid_.size;
  const size_t rows = held * size_t(size[1]) + size_t(size[0]) * held + size_t(size[0]) * size_t(size[1]);
  return voxels_.size() * (6 + 3 * sizeof(ShearCell)) + (rows + held * size_t(size[1])) * sizeof(uint32_t);
}

}  // namespace telesplat::sampler
