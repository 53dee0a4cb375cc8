// Between OpenXR's types and those of cameras.
#pragma once

#include <array>

#include "client/displays/xr/xr_api.h"
#include "common/geometry/camera.h"

namespace telesplat::viewer {

/// Both are right-handed, in metres, +y up, looking along -z. origin: the room's, in the headset's space.
geometry::Pose room_pose(const XrPosef& pose, const glm::dvec3& origin);
/// The camera of an eye; width x height pixels.
geometry::Camera eye_camera(const XrView& view, const glm::dvec3& origin, int width, int height, double near_m);

/// How far apart two depths are at a metre, of pictures with 16 bits for depths from near_m to far_m, metres.
double step_of_depth_m(double near_m, double far_m);

/// One camera that sees all that both eyes see, in the middle of their directions and so far behind them that its
/// frustum holds both, with as many pixels a radian as they have. What is asked for is chosen once, for it.
geometry::Camera both_eyes(const std::array<geometry::Camera, 2>& eyes);

}  // namespace telesplat::viewer
