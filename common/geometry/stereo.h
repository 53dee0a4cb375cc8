// Two eyes of one head.
#pragma once

#include <array>

#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// The cameras of both eyes, left then right: parallel, `distance_m` apart along the head's x axis, each with the head
/// camera's frustum.
std::array<Camera, 2> eye_cameras(const Camera& head, double distance_m);

/// One camera that sees all that the eyes see: the head's, moved back until its frustum holds both. What is to be drawn
/// is chosen once, for it; it sees nothing nearer larger than the eyes do by more than distance_m / (right - left) of
/// depth.
Camera enclosing_camera(const Camera& head, double distance_m);

}  // namespace telesplat::geometry
