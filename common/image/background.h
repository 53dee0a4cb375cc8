// What lies behind the data in pictures: a colour, or nothing.
#pragma once

#include <cstdint>
#include <string>

#include "common/core/result.h"
#include "common/image/file.h"

namespace telesplat::image {

struct Background {
  uint32_t colour = 0x00141820;  ///< 0x00RRGGBB; black where it is transparent
  bool transparent = false;
  bool operator==(const Background&) const = default;
};

/// "#rrggbb", a name (white, black, grey, ...), or "transparent". Error: lists what there is.
Result<Background> parse_background(const std::string& text);

/// Sets the upper byte of each colour of `over_black` to how much of the pixel the data cover, 0..255, from the same
/// picture over a white background: a background shines through by what both differ. Precondition: equal sizes.
void find_coverage(const View& over_white, View& over_black);

/// A colour over black and its coverage in the upper byte, as a colour by itself: 0xAARRGGBB, not premultiplied.
uint32_t straight_colour(uint32_t over_black);

}  // namespace telesplat::image
