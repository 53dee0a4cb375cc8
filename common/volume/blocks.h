// Byte planes through zstd's Huffman coder: the blocks of coded voxels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/entropy.h"

namespace telesplat::volume {

/// Appends `raw` as one self-delimiting block: constant, stored or zstd, whichever is shorter. Looks for repeated
/// strings only where one byte value is so frequent that a Huffman code, of a bit at least, would waste much on it.
void put_zstd_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);

/// Fills all of `raw` from the block at the reader's place; false where the block is damaged or holds another number of
/// bytes.
[[nodiscard]] bool get_zstd_block(codec::detail::Reader& in, std::span<uint8_t> raw);

}  // namespace telesplat::volume
