// Clips the draw list point by point: points that were sampled before the clip was ordered are cut at once, and no
// splat has its centre beyond a plane.
#pragma once

#include "common/geometry/clip.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Takes out of the list what the clip cuts away: whole clusters whose cubes lie outside, and single points of clusters
/// that a plane crosses. The points left of such an item are copied; the list owns the copies (DrawList::held). A point
/// counts as outside if it is so by more than the rounding of positions. O(items + points of clusters that a plane
/// crosses).
void clip_list(const geometry::Clip& clip, splat::DrawList& list);

}  // namespace telesplat::viewer
