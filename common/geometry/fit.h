// Where to stand so that a whole box is in the picture, with a small margin, whatever its shape.
#pragma once

#include "common/geometry/trajectory.h"

namespace telesplat::geometry {

/// How much of the picture's half width and half height stays free at least.
inline constexpr double kFitMargin = 0.05;

/// How steeply an orbit looks down on a box, in radians: 12 degrees on towers, 34 on what is flat.
double suitable_tilt_rad(const Box& box_room);

/// The pose in front of the box (on its +z side, tilted as above) that is as near as it can be, with as much room above
/// as below; it looks at a point of the box's vertical axis. frustum: what the
/// picture shows; its pose means nothing. middle_x: the picture of the frustum lies so far right of the view's axis, as
/// a tangent: beside what covers a part of a window. Preconditions: the box is not empty, the frustum has its axis
/// inside.
Pose fitted_view(const Box& box_room, const Camera& frustum, double middle_x = 0);
/// The same from another side: `back` leads from the box to the eye and has unit length. It looks at the box's centre;
/// seen from straight above, -z is up in the picture, from below +z.
Pose fitted_view_from(const glm::dvec3& back, const Box& box_room, const Camera& frustum, double middle_x = 0);

/// The smallest circle around the box's vertical axis from which all poses show the whole box; begins in front of it.
Trajectory fitted_orbit(const Box& box_room, const Camera& frustum, double period_s = 20.0);

}  // namespace telesplat::geometry
