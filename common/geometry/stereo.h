// Two eyes of one head, the screen that they look at, and cameras that see what both see.
#pragma once

#include <array>
#include <limits>

#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// A flat screen in the room: a window that cameras look through.
struct Screen {
  Pose pose;  ///< its middle; x to the right and y up as a person before it sees them, z towards that person
  double width_m = 1, height_m = 1;
};

/// Where a point of the room lies for the screen: metres to the right of its middle, above it, before it.
glm::dvec3 seen_from(const Screen& screen, const glm::dvec3& point_room);

/// The screen that fills the camera's frustum at `distance_m` before it. Precondition: distance_m > 0.
Screen screen_before(const Camera& camera, double distance_m);

/// The off-axis camera of an eye at this place that sees the room through the screen. Precondition: the eye lies before
/// the screen (z of seen_from > 0).
Camera camera_through(const Screen& screen, const glm::dvec3& eye_room, int width, int height, double near_m);

/// One camera whose frustum holds those of both, as tightly as a frustum can: it lies behind the eyes. Its pixels are
/// the first one's in number; it says what is in sight, not how large. Precondition: both have one orientation.
Camera enclosing_camera(const std::array<Camera, 2>& eyes);

/// The head's camera, wide enough that it sees (from the head's place) every direction in which an eye sees something
/// that is `nearest_m` away or farther. Pixels are as large as the head's, so it has more of them. Preconditions: the
/// eyes have the head's orientation; nearest_m > 0.
Camera widened_for(const Camera& head, const std::array<Camera, 2>& eyes, double nearest_m);

}  // namespace telesplat::geometry
