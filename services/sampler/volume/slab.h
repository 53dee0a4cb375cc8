// A sampler's part of a volume, ready to be splatted: the interface between the work for leases and the splatter, so
// that each can be tested alone.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/geometry/clip.h"
#include "common/volume/shear.h"
#include "common/volume/slices/image.h"
#include "common/volume/transfer/function.h"
#include "common/volume/voxels.h"

namespace telesplat::sampler {

class Slab {
 public:
  virtual ~Slab() = default;
  virtual size_t bytes() const = 0;
  /// As ShearSplatter::splat(); voxels: set to the number splatted.
  virtual std::vector<volume::SliceImage> splat(const std::vector<volume::LevelColour>& colours,
                                                const volume::ShearFrame& frame, int k_begin, int k_end,
                                                const geometry::Clip& clip, uint64_t& voxels) const = 0;
};

/// Arranges voxels for splatting.
using MakeSlab = std::function<std::shared_ptr<const Slab>(const volume::Grid& grid, volume::Voxels voxels)>;

}  // namespace telesplat::sampler
