// Composes one picture from two eyes' pictures, for displays that show both by place or by colour.
#pragma once

#include <array>
#include <cstdint>

#include "client/stereo/mode.h"
#include "common/image/file.h"

namespace telesplat::stereo {

/// Rows of 3: red, green and blue of the anaglyph from red, green and blue of one eye's picture.
using Matrix = std::array<float, 9>;
/// Two pictures in one for glasses with a red filter before the left eye and a cyan one before the right.
struct AnaglyphMatrices {
  Matrix left, right;
  bool linear = false;  ///< they are meant for linear light; else for displayed (sRGB) values
};

/// Grey: luma of ITU-R BT.601. Colour: channels as they are. Dubois, for red and cyan filters: the displayed colour
/// whose images through both filters are nearest to the pair's, in CIE XYZ, by least squares. Source: E. Dubois,
/// "Conversion of a Stereo Pair to Anaglyph with the Least-Squares Projection Method", University of Ottawa, 2009.
/// Precondition: an anaglyph's mode.
const AnaglyphMatrices& anaglyph_matrices(Mode mode);

/// Makes anaglyphs of `count` pixels, 0xAARRGGBB; alpha is the greater one. Colours that displays cannot show are cut
/// off.
void anaglyph(Mode mode, const uint32_t* left, const uint32_t* right, size_t count, uint32_t* out);

/// `out` gets the size of composed_size(). It gets depth if `depth` is set and both pictures have it: the pixel's own,
/// in squeezed pictures the nearer of two pixels, in anaglyphs the nearer of both eyes. Upper bytes go with the pixels;
/// anaglyphs have the greater one of both. With kOff it is the left picture. Preconditions: both pictures have one
/// size; the mode is not kAutostereo (interleaver.h); out is neither of them.
void compose(Mode mode, const image::View& left, const image::View& right, image::View& out, bool depth = true);

}  // namespace telesplat::stereo
