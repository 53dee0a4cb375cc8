// Residuals <-> one byte to be Huffman coded ("token") + a few raw bits that carry no redundancy worth coding.
// Log-linear classes, as in the hybrid integers of JPEG XL (ISO/IEC 18181-1, C.3.3): small values have their own token,
// larger ones share it with neighbours of about the same size, so that tables stay small and any spread of values codes
// well. Signed residuals come zigzag-folded: 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...
#pragma once

#include <array>
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

/// One class of byte residuals: z = base + raw bits.
struct ByteClass {
  uint8_t base, bits;
};

/// A normal's two byte residuals in one token, 16 classes each, so that their sizes' correlation is used.
struct NormalToken {
  static constexpr unsigned kMaxBits = 14;
  static constexpr std::array<ByteClass, 16> kClasses{{{0, 0},
                                                       {1, 0},
                                                       {2, 0},
                                                       {3, 0},
                                                       {4, 0},
                                                       {5, 0},
                                                       {6, 0},
                                                       {7, 0},
                                                       {8, 2},
                                                       {12, 2},
                                                       {16, 3},
                                                       {24, 3},
                                                       {32, 4},
                                                       {48, 4},
                                                       {64, 6},
                                                       {128, 7}}};
  static constexpr auto kClassOf = [] {
    std::array<uint8_t, 256> table{};
    for (unsigned z = 0; z < 256; ++z)
      for (unsigned c = 0; c < 16; ++c)
        if (z >= kClasses[c].base) table[z] = static_cast<uint8_t>(c);
    return table;
  }();
  struct Entry {
    uint16_t base;
    uint8_t low_bits, bits;
  };
  static constexpr auto kEntries = [] {
    std::array<Entry, 256> table{};
    for (unsigned t = 0; t < 256; ++t) {
      const ByteClass lo = kClasses[t & 15], hi = kClasses[t >> 4];
      table[t] = {static_cast<uint16_t>(lo.base | hi.base << 8), lo.bits, static_cast<uint8_t>(lo.bits + hi.bits)};
    }
    return table;
  }();

  static void put(uint16_t z, uint8_t* token, BitSink& bits) {
    const unsigned t = kClassOf[z & 255] | kClassOf[z >> 8] << 4;
    const Entry e = kEntries[t];
    const unsigned over = z - e.base;  // both bytes at once: neither is below its base
    *token = static_cast<uint8_t>(t);
    bits.put((over & 255) | over >> 8 << e.low_bits, e.bits);
  }
  static uint16_t get(uint8_t token, BitSource& bits) {
    const Entry e = kEntries[token];
    const uint32_t over = bits.take(e.bits);
    return static_cast<uint16_t>(e.base + (over & ((1u << e.low_bits) - 1)) + (over >> e.low_bits << 8));
  }
};

/// A colour's three byte residuals (0x00RRGGBB) in one token, 6 classes each: for smooth colour, where most are -2..1.
struct ColourToken {
  static constexpr unsigned kCount = 216, kMaxBits = 24;
  static constexpr std::array<ByteClass, 6> kClasses{{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 2}, {0, 8}}};
  static constexpr unsigned class_of(unsigned z) { return z < 4 ? z : z < 8 ? 4 : 5; }
  static constexpr auto kSmall = [] {  // token -> residuals, where all three are their class's base
    std::array<uint32_t, 256> table{};
    for (unsigned t = 0; t < kCount; ++t)
      table[t] = kClasses[t % 6].base | kClasses[t / 6 % 6].base << 8 | kClasses[t / 36].base << 16;
    return table;
  }();
  static constexpr auto kBits = [] {  // kCount and more: none
    std::array<uint8_t, 256> table{};
    for (unsigned t = 0; t < kCount; ++t)
      table[t] = static_cast<uint8_t>(kClasses[t % 6].bits + kClasses[t / 6 % 6].bits + kClasses[t / 36].bits);
    return table;
  }();

  static void put(uint32_t z, uint8_t* token, BitSink& bits) {
    if ((z & 0xFCFCFC) == 0) [[likely]] {
      *token = static_cast<uint8_t>(z * (36u + (6u << 8) + (1u << 16)) >> 16);  // b + 6 g + 36 r; no carries come in
      return;
    }
    unsigned t = 0;
    for (int shift = 16; shift >= 0; shift -= 8) t = t * 6 + class_of(z >> shift & 255);
    *token = static_cast<uint8_t>(t);
    for (int shift = 0; shift <= 16; shift += 8) {
      const ByteClass c = kClasses[class_of(z >> shift & 255)];
      bits.put((z >> shift & 255) - c.base, c.bits);
    }
  }
  static uint32_t get(uint8_t token, BitSource& bits) {
    uint32_t z = kSmall[token];
    if (kBits[token] == 0) [[likely]]
      return z;
    for (unsigned shift = 0, t = token; shift <= 16; shift += 8, t /= 6) z += bits.take(kClasses[t % 6].bits) << shift;
    return z;
  }
};

}  // namespace telesplat::codec::detail
