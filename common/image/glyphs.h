// The letters of image/canvas.h: seven rows of five dots each, the leftmost dot in the highest bit.
#pragma once

#include <array>
#include <cstdint>

namespace telesplat::image {

using Glyph = std::array<uint8_t, 7>;

/// The letter for a character; a hollow box for what is not printable ASCII.
const Glyph& glyph_of(char c);

}  // namespace telesplat::image
