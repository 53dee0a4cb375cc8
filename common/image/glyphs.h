// The letters of image/canvas.h: seven rows of five dots each, the leftmost dot in the highest bit.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace telesplat::image {

using Glyph = std::array<uint8_t, 7>;

/// The letter for a character; a hollow box if it is neither printable ASCII nor a common sign of units.
const Glyph& glyph_of(char32_t c);

/// Takes the first character off UTF-8 text; U+FFFD: it is not valid. Precondition: text is not empty.
char32_t take_character(std::string_view& text);

}  // namespace telesplat::image
