// One picture of two eyes' pictures, where a display shows them both by place or by colour.
#pragma once

#include "client/stereo/mode.h"
#include "common/image/file.h"

namespace telesplat::stereo {

/// `out` gets the size of composed_size(), and depth where it is asked for and both pictures have it: a pixel's own, of
/// squeezed pictures the nearer one of two, of anaglyphs the nearer one of both eyes'. Upper bytes go with the pixels;
/// anaglyphs have the greater one of both. With kOff it is the left picture.
/// Preconditions: both pictures have one size; the mode is not kAutostereo (interleaver.h); out is neither of them.
void compose(Mode mode, const image::View& left, const image::View& right, image::View& out, bool depth = true);

}  // namespace telesplat::stereo
