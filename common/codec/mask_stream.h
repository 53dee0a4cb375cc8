// Masks in messages: they mark the rays of a tile to cast.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "common/image/pixel_mask.h"

namespace telesplat::codec {

/// A mask of 1..kMaxPixels pixels as whole 32-bit words, little-endian, without its size.
std::vector<uint32_t> encode_mask(const image::PixelMask& mask);
/// Reads a mask of width x height pixels from the words of encode_mask(); other words give an error or some mask of
/// that size. Precondition: 1..kMaxPixels pixels.
Result<image::PixelMask> decode_mask(std::span<const uint32_t> words, int width, int height);

}  // namespace telesplat::codec
