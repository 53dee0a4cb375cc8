// Where an image's pixels look in the room, as the depth-image codec wants it (codec::RoomAxes).
#pragma once

#include <array>

#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// Of the part `rect` of a camera's image: row i . (x, y, 1) times a pixel's depth in metres is coordinate i, of room
/// space, of what its centre shows, from the eye; x and y are its column and row in the part.
std::array<std::array<double, 3>, 3> ray_axes(const Camera& camera, const Rect& rect);

}  // namespace telesplat::geometry
