// What a tile is of: its label, which goes unchanged from the lease to the patch.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::packer {

/// A frame of more tiles is refused.
inline constexpr uint32_t kMaxTilesInFrame = 1u << 16;

/// A rectangle of a frame, and whose frame that is.
struct FramePart {
  FrameId frame;
  EpochId epoch;
  InstanceId viewer;  ///< who asked for the frame,
  RequestId request;  ///< and with which request
  uint32_t tile = 0, tiles_in_frame = 0;
  uint32_t step = 1;        ///< the frame has every step-th pixel of every step-th row of the view
  geometry::Camera camera;  ///< of the whole frame
  geometry::Rect rect;      ///< the tile in it
  bool extra = false;       ///< of rays beyond what the view asked for: it completes no update
  /// Not 0: it ends its frame, of which so many tiles, itself included, are not sampled.
  uint32_t left_out = 0;
};

/// "tile 3 of frame 17". noun: what the part is called in messages.
std::string name_of(const FramePart& part, std::string_view noun);

/// Error: the camera is none, the frame has no tile of that number, or the rectangle does not lie in it.
Status check(const FramePart& part, std::string_view noun);

/// "96x40 pixels at (0, 24)".
std::string describe(const geometry::Rect& rect);

}  // namespace telesplat::packer
