// Samples that the model has already, though no view shows it.
#pragma once

#include <cstdint>

#include "common/points/point_model.h"
#include "services/packer/points/sampled_tile.h"

namespace telesplat::packer {

/// Clears the samples of the tile's image beside which, in the same leaf, the model has a point whose normal points to
/// the same side: within `nearest` times the finer one's footprint, in space. A reference depth map cannot tell: it has
/// one point a pixel, and none that faces away. Points of a head's rest count if `group` is its tag (Mosaic::group()).
/// So the surface and the finest footprint bound a model's points, from any number of views.
/// Returns how many it cleared.
uint64_t drop_known_points(const points::PointModel& model, float nearest, uint32_t group, SampledTile& tile);

}  // namespace telesplat::packer
