// Shear-splatting (T4.5.1): splats the voxels of a slab, slice by slice front to back, into one slice image per layer.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "common/volume/shear.h"
#include "common/volume/slices/image.h"
#include "common/volume/transfer/function.h"
#include "services/sampler/volume/shear/rows.h"
#include "services/sampler/volume/slab.h"

namespace telesplat::sampler {

// A sampler's voxels of one time step, arranged so that the slices of any principal axis can be visited in either
// direction.

/// Voxels of the slices [k_begin, k_end): a slab and one slice more on both sides. Immutable.
class SlabVolume {
 public:
  SlabVolume(const volume::Grid& grid, volume::Voxels voxels) : grid_(grid), voxels_(std::move(voxels)) {}

  const volume::Grid& grid() const { return grid_; }
  const volume::Voxels& voxels() const { return voxels_; }
  /// Memory that it takes, with the arrangements of all axes.
  size_t bytes() const;
  /// Returns the arrangement for a principal axis, made when a frame first needs it. Safe to call from several threads.
  const ShearRows& rows(int axis) const;

 private:
  volume::Grid grid_;
  volume::Voxels voxels_;
  mutable std::once_flag made_[3];
  mutable ShearRows rows_[3];
};

// Early termination: finds pixels that nearer layers hide, also from eyes a little beside the sampled one.

/// Bits of a raster's pixels, in bytes of 8 pixels, rows of blocks_across bytes.
class HiddenPixels {
 public:
  HiddenPixels(int width, int height);
  uint8_t* bytes() { return bytes_.data(); }
  const uint8_t* bytes() const { return bytes_.data(); }
  int blocks_across() const { return across_; }

  /// Keeps the pixels whose neighbours, to `dx` and `dy` pixels on all sides, are all set. Pixels beyond the raster
  /// count as set.
  void shrink(int dx, int dy);

 private:
  int width_, height_, across_;
  std::vector<uint8_t> bytes_;
};

struct ShearStats {
  uint64_t voxels = 0;   ///< splatted
  uint64_t skipped = 0;  ///< other voxels of the slab: transparent now, out of the raster, or behind opaque pixels
  uint64_t pixels = 0;   ///< composited, summed over slices
  double arrange_ms = 0, splat_ms = 0;
};

/// The slices [k_begin, k_end).
struct SlabSlices {
  int k_begin, k_end;
};

/// Splats a field: every voxel has an extinction (per Grid::unit_m) and a colour, lit by volume/lighting.h.
/// Within a slice, extinction and extinction times colour are interpolated bilinearly: a tent of one voxel, or of one
/// pixel where a voxel is smaller. The kernel is the same for all voxels of a slice (T4.5.1); its weights add up to 1
/// at every pixel. A slice adds opacity 1 - exp(-extinction * path), path = ShearFrame::path; slices are composited
/// front to back in single precision. Where the most opaque level has an extinction of more than 0.6 a slice in the
/// middle of the raster, planes half-way between slices are composited too, then with half the path each. Images are
/// cropped to their pixels that are not transparent; empty ones are left out. Early termination: voxels behind opaque
/// pixels are skipped, except in a margin around them, so that small head movements reveal no holes.
class ShearSplatter {
 public:
  explicit ShearSplatter(int threads);  ///< 0: one for each core. Images do not depend on it, nor on the SIMD target
  ~ShearSplatter();

  /// Returns images of a slab of the frame: pixels of owned_pixels() only. For those the volume must hold one slice
  /// more on both sides, if the grid has them; where pixels are larger than 1.5 voxels, the kernel is cut off at the
  /// slices held. colours: one for each level of the epoch. clip: voxels whose centres it cuts away are left out, so
  /// that the volume ends within a voxel of its planes. Precondition: validate(frame, grid).
  std::vector<volume::SliceImage> splat(const SlabVolume& volume, const std::vector<volume::LevelColour>& colours,
                                        const volume::ShearFrame& frame, const SlabSlices& slab,
                                        ShearStats* stats = nullptr, const geometry::Clip& clip = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Slabs that ShearSplatter splats.

/// All slabs share one splatter with `threads` threads (0: one for each core); one slab is splatted at a time.
MakeSlab make_shear_slabs(int threads);

}  // namespace telesplat::sampler
