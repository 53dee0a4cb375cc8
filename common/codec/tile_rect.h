// Where a tile lies in its image, and one pixel of it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace telesplat::codec::detail {

struct Pixel {
  uint32_t depth = 0, colour = 0;
  uint16_t normal = 0;
};

/// A rectangle of an image. `first`: index of its upper left pixel; `stride`: the image's width.
struct TileRect {
  size_t first, stride;
  int width, height;
  size_t index(int x, int y) const { return first + stride * static_cast<size_t>(y) + static_cast<size_t>(x); }
};

}  // namespace telesplat::codec::detail
