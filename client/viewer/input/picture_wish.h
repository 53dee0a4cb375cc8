// A picture that a person wants of what is on display.
#pragma once

namespace telesplat::viewer {

struct PictureWish {
  int width = 0, height = 0;  ///< pixels; 0: as the display has them
  bool exr = false;           ///< EXR with depth, else PNG
  bool own_size() const { return width > 0 && height > 0; }
  bool operator==(const PictureWish&) const = default;
};

}  // namespace telesplat::viewer
