// Coverage masks of tiles and their coding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/codec/entropy.h"
#include "common/image/pixel_mask.h"

namespace telesplat::codec::detail {

using image::for_each_set;
using Mask = image::PixelMask;

/// Sets bit x of `words` if depth[x] != 0. Bits of the last word at and beyond `count` become 0.
void covered_bits(const uint32_t* depth, size_t count, uint64_t* words);

void put_mask(std::vector<uint8_t>& out, const Mask& mask);
/// Fills a mask whose size reset() set. False: the stream is damaged.
[[nodiscard]] bool get_mask(Reader& in, Mask& mask);

}  // namespace telesplat::codec::detail
