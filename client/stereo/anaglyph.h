// Two pictures in one for glasses with a red filter before the left eye and a cyan one before the right.
#pragma once

#include <array>
#include <cstdint>

#include "client/stereo/mode.h"

namespace telesplat::stereo {

/// Rows of 3: red, green and blue of the anaglyph from red, green and blue of one eye's picture.
using Matrix = std::array<float, 9>;
struct AnaglyphMatrices {
  Matrix left, right;
  bool linear = false;  ///< they are meant for linear light; else for displayed (sRGB) values
};

/// Grey: luma of ITU-R BT.601. Colour: channels as they are. Dubois: for red and cyan filters, E. Dubois, "Conversion
/// of a Stereo Pair to Anaglyph with the Least-Squares Projection Method", University of Ottawa, 2009: the displayed
/// colour whose images through both filters are nearest to the pair's, in the sense of CIE XYZ, by least squares.
/// Precondition: an anaglyph's mode.
const AnaglyphMatrices& anaglyph_matrices(Mode mode);

/// Anaglyphs of `count` pixels, 0xAARRGGBB; alpha is the greater one. What lies outside of what displays show is cut
/// off.
void anaglyph(Mode mode, const uint32_t* left, const uint32_t* right, size_t count, uint32_t* out);

}  // namespace telesplat::stereo
