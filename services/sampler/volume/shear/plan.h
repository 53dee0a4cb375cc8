// Where the slices of a slab lie in a frame's raster.
#pragma once

#include <vector>

#include "common/geometry/camera.h"
#include "common/volume/shear.h"
#include "common/volume/transfer/function.h"
#include "services/sampler/volume/shear/scene.h"

namespace telesplat::sampler {

struct LayerSlices {
  int begin = 0, end = 0;  ///< of ShearPlan::slices
  geometry::Rect rect;     ///< raster pixels that they reach, in whole blocks; no width: none
};

struct ShearPlan {
  std::vector<SplatSlice> slices;  ///< of all layers, front to back
  std::vector<LayerSlices> layers;
};

/// The slices that are a sampler's own, [begin, end), and those that it holds.
struct SlabRange {
  int begin = 0, end = 0;
  int held_begin = 0, held_end = 0;
};

/// How many planes a slice is sampled on: two where levels are so opaque that one would show as a step, else one. All
/// samplers of a frame come to the same answer.
int planes_of(const volume::Grid& grid, const volume::ShearFrame& frame,
              const std::vector<volume::LevelColour>& colours);

/// planes: of a slice, 1 or 2.
ShearPlan plan_slices(const volume::Grid& grid, const volume::ShearFrame& frame, const ShearRows& rows,
                      const SlabRange& slab, int planes);

/// Path lengths (ShearFrame::path) for each raster row and block, as SplatScene::paths wants them: polynomials of the
/// pixel in the block that are right at its first, middle and last one.
std::vector<float> block_paths(const volume::Grid& grid, const volume::ShearFrame& frame, int blocks_across,
                               int planes);

}  // namespace telesplat::sampler
