// Finds poses that show a whole box with a small margin, for boxes of any shape.
#pragma once

#include "common/geometry/trajectory.h"

namespace telesplat::geometry {

/// Least share of the picture's half width and half height that stays free.
inline constexpr double kFitMargin = 0.05;

/// Angle at which an orbit looks down on a box, in radians: 12 degrees on towers, 34 on flat boxes.
double suitable_tilt_rad(const Box& box_room);

/// The nearest pose in front of the box (on its +z side, tilted as above) that shows all of it, with as much room above
/// as below; it looks at a point of the box's vertical axis. frustum: of the picture; its pose is ignored. middle_x:
/// tangent of the angle by which the picture's middle lies to the right of the view's axis, beside a panel that covers
/// a part of a window. Preconditions: the box is not empty, the frustum has its axis inside.
Pose fitted_view(const Box& box_room, const Camera& frustum, double middle_x = 0);
/// The same from another side: `back` leads from the box to the eye and has unit length. It looks at the box's centre.
/// Seen from straight above, -z is up in the picture, from below +z.
Pose fitted_view_from(const glm::dvec3& back, const Box& box_room, const Camera& frustum, double middle_x = 0);

/// The smallest circle around the box's vertical axis from which all poses show the whole box; begins in front of it.
Trajectory fitted_orbit(const Box& box_room, const Camera& frustum, double period_s = 20.0);

}  // namespace telesplat::geometry
