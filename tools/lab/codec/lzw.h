// How long LZW makes a depth image: what the thesis compresses its images with (T4.4), as a baseline.
// Source: TIFF Revision 6.0, sections 13 and 14: Welch 1984, codes of 9 to 12 bits, after differences of neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/image/depth_image.h"

namespace telesplat::lab {

/// Bits of the codes, with the one that clears the table at the beginning and wherever it is full, and the one at the
/// end; no padding. No bytes: 18.
size_t lzw_bits(std::span<const uint8_t> bytes);

/// Bits of the planes of an image, each of them a strip of its own: bytes in order of rows, colours as red, green,
/// blue, and of each byte the difference from the one a pixel to the left. Depth is three bytes, or 24-bit numbers
/// whose differences are taken whole, whichever is less. No header and no table of contents, of which a TIFF file has
/// some hundred bytes.
size_t lzw_bits(const image::DepthImage& image);

}  // namespace telesplat::lab
