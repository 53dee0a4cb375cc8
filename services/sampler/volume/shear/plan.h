// Places the slices of a slab in a frame's raster.
#pragma once

#include <vector>

#include "common/geometry/camera.h"
#include "common/volume/shear.h"
#include "common/volume/transfer/function.h"
#include "services/sampler/volume/shear/scene.h"

namespace telesplat::sampler {

struct LayerSlices {
  int begin = 0, end = 0;  ///< indices in ShearPlan::slices
  geometry::Rect rect;     ///< raster pixels that they reach, in whole blocks; width 0: no pixels
};

struct ShearPlan {
  std::vector<SplatSlice> slices;  ///< slices of all layers, front to back
  std::vector<LayerSlices> layers;
};

/// The slices that a sampler owns, [begin, end), and those that it holds.
struct SlabRange {
  int begin = 0, end = 0;
  int held_begin = 0, held_end = 0;
};

/// Returns the number of planes on which a slice is sampled: two if levels are so opaque that one would show as a step,
/// else one. All samplers of a frame get the same result.
int planes_of(const volume::Grid& grid, const volume::ShearFrame& frame,
              const std::vector<volume::LevelColour>& colours);

/// planes: number for each slice, 1 or 2.
ShearPlan plan_slices(const volume::Grid& grid, const volume::ShearFrame& frame, const ShearRows& rows,
                      const SlabRange& slab, int planes);

/// Returns path lengths (ShearFrame::path) for each raster row and block, for SplatScene::paths: polynomials of the
/// pixel in the block that are exact at its first, middle and last pixel.
std::vector<float> block_paths(const volume::Grid& grid, const volume::ShearFrame& frame, int blocks_across,
                               int planes);

}  // namespace telesplat::sampler
