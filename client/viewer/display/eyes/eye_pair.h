// The cameras of a frame that two eyes see.
#pragma once

#include <array>
#include <cmath>

#include "common/geometry/camera.h"

namespace telesplat::viewer {

struct EyePair {
  geometry::Camera head;                 ///< stands between the eyes, with their orientation
  std::array<geometry::Camera, 2> eyes;  ///< left, right: all three have one size and pixels of one size
  double screen_m = 0;                   ///< how far the screen is before the head's place
};

/// Whether both eyes look the same way with pixels of one size, so that one choice of points serves both.
inline bool alike(const std::array<geometry::Camera, 2>& eyes) {
  constexpr double kParallel = 1e-6, kSameFocal = 1e-4;
  const double turned = std::abs(glm::dot(eyes[0].pose.orientation, eyes[1].pose.orientation));
  return 1 - turned < kParallel && eyes[0].width == eyes[1].width && eyes[0].height == eyes[1].height &&
         std::abs(eyes[0].focal_x() / eyes[1].focal_x() - 1) < kSameFocal;
}

/// Stands between two eyes that look the same way, and looks as they do.
inline geometry::Camera between(const std::array<geometry::Camera, 2>& eyes) {
  geometry::Camera out = eyes[0];
  out.pose.position_room = 0.5 * (eyes[0].pose.position_room + eyes[1].pose.position_room);
  return out;
}

}  // namespace telesplat::viewer
