// Symbols <-> bits by asymmetric numeral systems (J. Duda, 2013, "range" variant, as in F. Giesen's interleaved coders,
// 2014): 32 or 64 states that take turns, 11-bit frequencies, words of 16 bits.
//
// A symbol is a token (eight a factor of two, as the hybrid integers of JPEG XL, ISO/IEC 18181-1, C.3.3) and its raw
// bits. State x in [2^15, 2^31):
//   token of frequency f that starts at s:  x -> x / f * 2048 + x % f + s
//   k raw bits, k <= 15:                    x -> x * 2^k + bits
// Before either, the lower 16 bits of a state that would become too large are written. Symbol i of a row belongs to
// state i % 32 or 64. Decoding undoes this: it reads words from the last one backwards. Of 32 symbols it undoes the
// tokens, then raw bits above the lowest 15, then the lowest 15; and each of these from their last state to the first.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace telesplat::codec::detail {

inline constexpr unsigned kFrequencyBits = 11;
inline constexpr uint32_t kFrequencyOne = 1u << kFrequencyBits;
inline constexpr unsigned kStateBits = 31;  ///< of states, at most
inline constexpr uint32_t kStateLow = 1u << 15;
inline constexpr size_t kLanes = 32, kContexts = 16, kSymbols = 256;
inline constexpr size_t kEnoughForMore = 32768;  // pixels
inline constexpr size_t kMostStates = 2 * kLanes;

/// How many states a tile has: with more, a processor need not wait for one group of symbols before it begins the next;
/// but each takes four bytes.
constexpr size_t states_of(size_t symbols) { return symbols < kEnoughForMore ? kLanes : kMostStates; }

/// Division by a frequency as a product (R. Alverson, "Integer division using reciprocals", 1991). A state x is too
/// large for it if x and the bits of 2048 - frequency, where they stand, add up to 2^31 or more.
struct EncodeEntry {
  uint32_t reciprocal = 0;
  uint32_t packed = 0;  ///< bits 0-12: what is added, 13-16: shift, 20-30: 2048 - frequency

  static constexpr unsigned kShiftAt = 13, kComplementAt = kStateBits - kFrequencyBits;
  static constexpr uint32_t kAddMask = (1u << kShiftAt) - 1, kShiftMask = 15;

  static EncodeEntry of(uint32_t start, uint32_t frequency) {
    if (frequency == 0) return {};
    if (frequency == 1) return {~0u, (start + kFrequencyOne - 1) | (kFrequencyOne - 1) << kComplementAt};
    const unsigned bits = static_cast<unsigned>(std::bit_width(frequency - 1));
    const uint64_t reciprocal = ((uint64_t{1} << (bits + 31)) + frequency - 1) / frequency;
    return {static_cast<uint32_t>(reciprocal),
            start | (bits - 1) << kShiftAt | (kFrequencyOne - frequency) << kComplementAt};
  }
  /// That of a token which starts so much later.
  EncodeEntry from(uint32_t start) const { return {reciprocal, packed + start}; }
};

/// The symbols of a row that are to be put. Tokens below `first` have no raw bits; others are first + the token of z.
struct SymbolRow {
  const uint16_t* symbols = nullptr;  ///< contexts * kSymbols + tokens
  const uint32_t* wide = nullptr;     ///< z; or
  const uint8_t* narrow = nullptr;    ///< z below 256
  size_t count = 0;
  unsigned first = 0;
  size_t states = kLanes;  ///< how many take turns: kLanes or twice that
};

/// Where the symbols of a row go: the same. z of a token below `first` is that of `first`.
struct DecodedRow {
  const uint8_t* contexts = nullptr;
  uint8_t* tokens = nullptr;
  uint32_t* wide = nullptr;
  uint8_t* narrow = nullptr;
  size_t count = 0;
  unsigned first = 0;
  size_t states = kLanes;
  const uint8_t* readable = nullptr;  ///< where what may be read begins, if that is before the words; else null
};

/// Token of z < 2^24: eight a factor of two. The exponent and the first three bits after it, as a float has them.
inline uint32_t token_of(uint32_t z) { return (std::bit_cast<uint32_t>(static_cast<float>(z + 8)) >> 20) - 1040; }
inline constexpr unsigned kNumberTokens = 169, kByteTokens = 41;

}  // namespace telesplat::codec::detail
