// Shear-splatting (T4.5.1): the voxels of a slab, slice by slice front to back, into one slice image a layer.
#pragma once

#include <memory>
#include <vector>

#include "common/volume/shear.h"
#include "common/volume/slices/image.h"
#include "common/volume/transfer/function.h"
#include "services/sampler/volume/shear/slab_volume.h"

namespace telesplat::sampler {

struct ShearStats {
  uint64_t voxels = 0;   ///< splatted
  uint64_t skipped = 0;  ///< other voxels of the slab: transparent now, out of the raster, or behind what is opaque
  uint64_t pixels = 0;   ///< composited, summed over slices
  double arrange_ms = 0, splat_ms = 0;
};

/// The field that is splatted: every voxel has an extinction (per Grid::unit_m) and a colour, lit by volume/lighting.h.
/// Within a slice, extinction and extinction times colour are interpolated bilinearly: a tent of one voxel, or of one
/// pixel where a voxel is smaller. The kernel is the same for all voxels of a slice (T4.5.1); its weights add up to 1
/// at every pixel. A slice adds opacity 1 - exp(-extinction * path), path = ShearFrame::path; slices are composited
/// front to back in single precision. Where the most opaque level has an extinction of more than 0.6 a slice in the
/// middle of the raster, planes half-way between slices are composited too, then with half the path each. Images are
/// cropped to what is not transparent; empty ones are left out. Early termination: what lies behind opaque pixels is
/// skipped, but for a margin around them, so that small head movements reveal no holes.
class ShearSplatter {
 public:
  explicit ShearSplatter(int threads);  ///< 0: one a core. Images do not depend on it, nor on the SIMD target
  ~ShearSplatter();

  /// Images of the slab [k_begin, k_end) of the frame: pixels of owned_pixels() only. For those the volume must hold
  /// one slice more on both sides, where the grid has them; where pixels are larger than 1.5 voxels, the kernel ends
  /// with what is held. colours: one a level of the epoch. clip: voxels whose centres it cuts away are not there, so
  /// that what is shown ends within a voxel of its planes. Precondition: validate(frame, grid).
  std::vector<volume::SliceImage> splat(const SlabVolume& volume, const std::vector<volume::LevelColour>& colours,
                                        const volume::ShearFrame& frame, int k_begin, int k_end,
                                        ShearStats* stats = nullptr, const geometry::Clip& clip = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::sampler
