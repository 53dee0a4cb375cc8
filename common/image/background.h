// The background of pictures: a colour, or transparent.
#pragma once

#include <cstdint>
#include <string>

#include "common/core/result.h"
#include "common/image/file.h"

namespace telesplat::image {

struct Background {
  uint32_t colour = 0x00141820;  ///< 0x00RRGGBB; black if transparent
  bool transparent = false;
  bool operator==(const Background&) const = default;
};

/// Reads "#rrggbb", a name (white, black, grey, ...), or "transparent". Error: lists the valid ones.
Result<Background> parse_background(const std::string& text);

/// Sets the upper byte of each colour of `over_black` to the data's coverage of the pixel, 0..255, from the same
/// picture over a white background: both differ by the light of the background. Precondition: equal sizes.
void find_coverage(const View& over_white, View& over_black);

/// Converts a colour over black, with its coverage in the upper byte, to 0xAARRGGBB, not premultiplied.
uint32_t straight_colour(uint32_t over_black);

}  // namespace telesplat::image
