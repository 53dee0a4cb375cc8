// Finds the place along a ray where a volume first hides enough, by its voxels.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "common/geometry/clip.h"
#include "common/scene/probe.h"
#include "common/volume/session.h"

namespace telesplat::data {

/// Returns the level at index coordinates of voxels; callers stay inside the grid.
using LevelAt = std::function<double(int i, int j, int k)>;

/// Values between voxels are trilinear, opacity is the transfer function's of these values, and the place is the first
/// one where the volume in front, with the place itself, hides probe.opacity. The picture is made of splats, one per
/// voxel, so it may differ from that by about a voxel.
///
/// Bounds: the data between voxels are not known; they deviate from trilinear values by about t (1 - t) / 2 of the
/// second differences of the voxels around, t of the way from one voxel to the next (the error of linear
/// interpolation), and levels are rounded. The place lies between those where the largest and the smallest opacity of
/// such values hide enough; if these lie more than four voxels off, as at thin structures amid noise, there is no
/// bound. The value's bound covers all values between these places; without these places, the values possible at the
/// place.
///
/// held: this server's slices, from the first to the one after the last; levels of one more on each side are known,
/// where the grid has one. Error: the ray does not meet enough, or first meets slices that are not known.
Result<scene::Probed> cast(const volume::Session& session, const std::pair<int, int>& held, const LevelAt& level_at,
                           const volume::TransferFunction& transfer, const geometry::Clip& clip,
                           const scene::Probe& probe);

}  // namespace telesplat::data
