// The view update that a displayed frame shows: what its age and its error are counted from.
#pragma once

#include "common/core/ids.h"
#include "common/geometry/camera.h"

namespace telesplat::viewer {

struct ShownUpdate {
  RequestId request;
  double requested_s = 0;  ///< master's clock
  geometry::Pose pose;     ///< that was asked for
  double posed_s = 0;      ///< master's clock: the head was there, unless it was predicted
};

}  // namespace telesplat::viewer
