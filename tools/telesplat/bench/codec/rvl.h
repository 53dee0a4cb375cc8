// RVL, a codec for depth images that is made for speed alone, as a baseline.
// Source: A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017, listing 1; here of 32-bit values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Runs of zeros and of other values in turn: their lengths, then of each other value the difference from the one
/// before, zigzag. Numbers are groups of three bits, the lowest first, each with a bit that says whether there are
/// more: half bytes, the first in the high half. Half a byte at the end is filled up.
std::vector<uint8_t> rvl_encode(std::span<const uint32_t> values);

/// The other way. Error: not exactly `count` values.
Result<std::vector<uint32_t>> rvl_decode(std::span<const uint8_t> bytes, size_t count);

}  // namespace telesplat::launcher
