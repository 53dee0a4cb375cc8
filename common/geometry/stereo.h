// Two eyes of one head, their screen, and cameras that see everything that both see.
#pragma once

#include <array>
#include <limits>

#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// A flat screen in the room: a window that cameras look through.
struct Screen {
  Pose pose;  ///< its middle; x to the right and y up for a person before it, z towards that person
  double width_m = 1, height_m = 1;
};

/// Place of a point of the room relative to the screen: metres to the right of its middle, above it, before it.
glm::dvec3 seen_from(const Screen& screen, const glm::dvec3& point_room);

/// The screen that fills the camera's frustum at `distance_m` before it. Precondition: distance_m > 0.
Screen screen_before(const Camera& camera, double distance_m);

/// The off-axis camera of an eye at eye_room that sees the room through the screen. Precondition: the eye lies before
/// the screen (z of seen_from > 0).
Camera camera_through(const Screen& screen, const glm::dvec3& eye_room, int width, int height, double near_m);

/// One camera behind the eyes whose frustum holds both of theirs, as tightly as possible, with the first one's
/// number of pixels. For finding what is in sight, not its size. Precondition: both eyes have one orientation.
Camera enclosing_camera(const std::array<Camera, 2>& eyes);

/// The head's camera, widened to see (from the head's place) every direction in which an eye sees points at least
/// `nearest_m` away. Its pixels are as large as the head's, so it has more of them. Preconditions: the eyes have the
/// head's orientation; nearest_m > 0.
Camera widened_for(const Camera& head, const std::array<Camera, 2>& eyes, double nearest_m);

}  // namespace telesplat::geometry
