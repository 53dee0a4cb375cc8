// The cameras of a head's two eyes.
#pragma once

#include <array>
#include <limits>
#include <utility>

#include "common/geometry/camera.h"

namespace telesplat::geometry {

/// Returns the cameras of both eyes, left then right, `separation_m` apart along the head's x axis, both looking along
/// its -z. Each has an off-axis frustum, so that both see the same window `screen_m` before the head: a point there has
/// the same place in both pictures. Infinity: each has the head camera's frustum. Precondition: screen_m > 0.
inline std::array<Camera, 2> eye_cameras(const Camera& head, double separation_m,
                                         double screen_m = std::numeric_limits<double>::infinity()) {
  std::array<Camera, 2> eyes{head, head};
  for (const auto& [eye, aside_m] : {std::pair{&eyes[0], -0.5 * separation_m}, {&eyes[1], 0.5 * separation_m}}) {
    eye->pose.position_room += head.pose.orientation * glm::dvec3(aside_m, 0, 0);
    eye->left -= aside_m / screen_m;
    eye->right -= aside_m / screen_m;
  }
  return eyes;
}

}  // namespace telesplat::geometry
