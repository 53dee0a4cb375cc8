// Clips what is drawn, point by point: what was sampled before a clip was ordered shows it at once, and no splat has
// its centre beyond a plane.
#pragma once

#include "common/geometry/clip.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Takes out of the list what the clip cuts away: whole clusters whose cubes lie outside, and of those that a plane
/// crosses the points one by one. Points that are left of such an item are copied; the list owns the copies
/// (DrawList::held). A point counts as outside where it is by more than positions are rounded. O(items + points of
/// clusters that a plane crosses).
void clip_list(const geometry::Clip& clip, splat::DrawList& list);

}  // namespace telesplat::viewer
