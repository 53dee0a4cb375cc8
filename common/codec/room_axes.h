// Directions of an image's pixels, for encoders: normals follow from them and from depth, and colours of many data sets
// follow a height in the room.
#pragma once

#include <array>
#include <vector>

#include "common/codec/depth_codec.h"

namespace telesplat::codec {

/// axis . (x, y, 1), divided by a pixel's depth code, is that coordinate of the pixel's point relative to the eye, in a
/// unit of its own; x and y are the pixel's column and row in the image.
using RoomAxes = std::array<std::array<double, 3>, 3>;

/// As encode() in depth_codec.h, with the same bounds. With `axes` normals take fewer bytes, and so do colours that
/// follow one of the room's axes.
std::vector<uint8_t> encode(const image::DepthImage& image, const ErrorBounds& bounds, image::DepthImage* decoded,
                            const RoomAxes& axes);

}  // namespace telesplat::codec
