// Where the camera of a recorded depth image stood.
#pragma once

#include <optional>
#include <string>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::launcher {

/// What cameras.csv beside a .depth file says of it; nothing if it is not there or has no such frame. path ends in the
/// frame's number: "frame-000012.depth". Error: it is no such table; names file and line.
Result<std::optional<geometry::Camera>> recorded_camera(const std::string& path);

}  // namespace telesplat::launcher
