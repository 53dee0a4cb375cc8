// Numbers <-> one byte to be coded ("token") + a few raw bits that carry no redundancy worth coding.
// Log-linear classes, as in the hybrid integers of JPEG XL (ISO/IEC 18181-1, C.3.3): small values have their own token,
// larger ones share it with neighbours of about the same size, so that tables stay small and any spread of values codes
// well.
#pragma once

#include <bit>
#include <cstdint>

#include "common/codec/entropy.h"

namespace telesplat::codec::detail {

/// Any z < 2^24: eight tokens per factor of two.
struct NumberToken {
  static constexpr unsigned kCount = 8 * 22, kMaxBits = 21;
  static void put(uint32_t z, uint8_t* token, BitSink& bits) {
    const uint32_t v = z + 8, shift = 28 - static_cast<uint32_t>(std::countl_zero(v));
    *token = static_cast<uint8_t>(8 * shift + (v >> shift & 7));
    bits.put(v & ((1u << shift) - 1), shift);
  }
  /// Tokens of kCount and more give nonsense, and take up to 31 bits.
  static uint32_t get(uint8_t token, BitSource& bits) {
    const unsigned shift = token >> 3;
    return ((8u + (token & 7)) << shift) - 8 + bits.take(shift);
  }
};

}  // namespace telesplat::codec::detail
