// The cameras of a frame that two eyes see.
#pragma once

#include <array>

#include "common/geometry/camera.h"

namespace telesplat::viewer {

struct EyePair {
  geometry::Camera head;                 ///< stands between the eyes, with their orientation
  std::array<geometry::Camera, 2> eyes;  ///< left, right: all three have one size and pixels of one size
  double screen_m = 0;                   ///< how far the screen is before the head's place
};

}  // namespace telesplat::viewer
