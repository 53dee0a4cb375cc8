// Where along a ray a volume first hides enough, found in the voxels.
#pragma once

#include <functional>
#include <optional>

#include "common/geometry/clip.h"
#include "common/scene/probe.h"
#include "common/volume/session.h"

namespace telesplat::data {

/// The level at index coordinates of voxels; callers stay inside the grid.
using LevelAt = std::function<double(int i, int j, int k)>;

/// Values between voxels are trilinear, opacity is the transfer function's of these values, and the place is the first
/// one at which what lies before it and the place itself hide probe.opacity. The picture is made of splats, one a
/// voxel, so it may differ from that by about a voxel.
///
/// Bounds: how values run between voxels is not known; they deviate from the trilinear ones by about t (1 - t) / 2 of
/// the second differences of the voxels around, t of the way from one voxel to the next (the error of linear
/// interpolation), and levels are rounded. The place lies
/// between those at which the largest and the smallest opacity of such values hide enough; where they lie more than
/// four voxels off, as at thin things amid noise, there is no bound. The value's bound covers all values between these
/// places, without them those that may lie at the place.
///
/// begin, end: the slices that are this server's; levels of one more on each side are known, where there are some.
/// Error: the ray does not meet enough, or meets slices that are not known first.
Result<scene::Probed> cast(const volume::Session& session, int begin, int end, const LevelAt& level_at,
                           const volume::TransferFunction& transfer, const geometry::Clip& clip,
                           const scene::Probe& probe);

}  // namespace telesplat::data
