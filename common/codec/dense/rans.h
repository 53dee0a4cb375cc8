// Symbols <-> words of 16 bits by asymmetric numeral systems (J. Duda, 2013, "range" variant, as in F. Giesen's
// interleaved coders, 2014): kStates states that take turns, 11-bit frequencies.
//
// A symbol is a token (eight a factor of two, as the hybrid integers of JPEG XL, ISO/IEC 18181-1, C.3.3) and its raw
// bits. State x in [2^15, 2^31):
//   token of frequency f that starts at s:  x -> x / f * 2048 + x % f + s
//   k raw bits, k <= 15:                    x -> x * 2^k + bits
// Before either, the lower 16 bits of a state that would become too large are written. Decoding reverses this from the
// last word to the first: it takes a symbol's token, then its raw bits above the lowest 15, then the lowest 15.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace telesplat::codec::detail {

inline constexpr unsigned kFrequencyBits = 11;
inline constexpr uint32_t kFrequencyOne = 1u << kFrequencyBits;
inline constexpr uint32_t kStateLow = 1u << 15, kStateEnd = 1u << 31;
inline constexpr size_t kStates = 8, kContexts = 16, kSymbols = 256;
inline constexpr size_t kStateBytes = 4 * kStates;
inline constexpr size_t kMostSymbolBytes = 6;

/// Token of z < 2^24: eight a factor of two. The exponent and the first three bits after it, as a float has them.
inline uint32_t token_of(uint32_t z) {
  return (std::bit_cast<uint32_t>(static_cast<float>(static_cast<int32_t>(z + 8))) >> 20) - 1040;
}
inline constexpr unsigned kNumberTokens = 169, kByteTokens = 41;

/// A token's part of the 2048.
struct EncodeEntry {
  uint16_t start = 0, frequency = 0;
};

/// 2^42 / f, rounded up. The product with x < 2^20 f fits 64 bits, and its bits from the 42nd on are x / f exactly:
/// the error, below (f - 1) x / f < 2^31 units of 2^-42, does not reach 1 / f.
inline constexpr auto kReciprocals = [] {
  std::array<uint64_t, kFrequencyOne + 1> out{};
  for (uint64_t f = 1; f <= kFrequencyOne; ++f) out[f] = ((uint64_t{1} << 42) + f - 1) / f;
  return out;
}();

/// Puts symbols, the last one first.
class SymbolEncoder {
 public:
  /// symbols: number of puts that follow. out: room for kMostSymbolBytes of each, and two bytes.
  void start(size_t symbols, uint8_t* out) {
    std::fill_n(states_, kStates, kStateLow);
    next_ = symbols, out_ = out;
  }
  /// bits: number of raw bits, taken from z + 8.
  void put(EncodeEntry entry, uint32_t z, unsigned bits) {
    uint32_t& x = states_[--next_ % kStates];
    const uint32_t v = z + 8;
    const unsigned low = std::min(bits, 15u), high = bits - low;
    put_bits(x, v, low);
    if (high != 0) put_bits(x, v >> 15, high);
    put_word_if(x >= uint32_t{entry.frequency} << (31 - kFrequencyBits), x);
    const auto quotient = static_cast<uint32_t>(x * kReciprocals[entry.frequency] >> 42);
    x += quotient * (kFrequencyOne - entry.frequency) + entry.start;
  }
  uint8_t* end() const { return out_; }
  /// To be called after the last symbol: writes kStateBytes.
  void put_states(uint8_t* to) const { std::memcpy(to, states_, kStateBytes); }
  bool at_rest() const {
    return std::all_of(states_, states_ + kStates, [](uint32_t x) { return x == kStateLow; });
  }

 private:
  void put_word_if(uint32_t full, uint32_t& x) {  // full: 0 or 1, as a number: a branch would be mispredicted
    const auto word = static_cast<uint16_t>(x);
    std::memcpy(out_, &word, 2);
    out_ += 2 * full, x >>= 16 * full;
  }
  void put_bits(uint32_t& x, uint32_t bits, unsigned count) {
    put_word_if(x >> (31 - count) != 0, x);
    x = x << count | (bits & ((1u << count) - 1));
  }
  uint32_t states_[kStates];
  size_t next_ = 0;
  uint8_t* out_ = nullptr;
};

/// Takes symbols, the first one first, from words, the last one first.
class SymbolDecoder {
 public:
  /// states: kStateBytes of put_states(); null: all at rest. False: one is out of range.
  [[nodiscard]] bool start(const uint8_t* states) {
    std::fill_n(states_, kStates, kStateLow);
    if (states != nullptr) std::memcpy(states_, states, kStateBytes);
    next_ = 0;
    return std::all_of(states_, states_ + kStates, [](uint32_t x) { return x >= kStateLow && x < kStateEnd; });
  }
  bool at_rest() const {
    return std::all_of(states_, states_ + kStates, [](uint32_t x) { return x == kStateLow; });
  }
  /// `count` symbols from the words: table is that of make_decode_tables(), tokens below `first` have no raw bits.
  /// Returns false if words are missing.
  [[nodiscard]] bool get(const uint32_t* table, const uint8_t* contexts, size_t count, unsigned first, uint8_t* tokens,
                         uint32_t* z) {
    const bool plenty = static_cast<size_t>(end - begin) >= kMostSymbolBytes * count;
    return plenty ? take<false>(table, contexts, count, first, tokens, z)
                  : take<true>(table, contexts, count, first, tokens, z);
  }
  const uint8_t *begin = nullptr, *end = nullptr;  ///< words that are left

 private:
  template <bool kChecked>
  static bool refill(uint32_t& x, const uint8_t* begin, const uint8_t*& end) {
    if (kChecked && end - begin < 2) return x >= kStateLow;
    uint16_t word;
    std::memcpy(&word, end - 2, 2);
    const uint32_t low = x < kStateLow;  // without a branch: it would be mispredicted
    x = low != 0 ? x << 16 | word : x;
    end -= 2 * low;
    return true;
  }
  template <bool kChecked>
  bool take(const uint32_t* table, const uint8_t* contexts, size_t count, unsigned first, uint8_t* tokens,
            uint32_t* z) {
    const uint8_t *at = end, *const first_word = begin;
    bool good = true;
    for (size_t i = 0; i < count; ++i) {
      uint32_t& state = states_[next_++ % kStates];
      const uint32_t entry = table[contexts[i] * kFrequencyOne + (state & (kFrequencyOne - 1))];
      uint32_t x = ((entry >> 12 & 0xFFF) + 1) * (state >> kFrequencyBits) + (entry & 0xFFF);
      good &= refill<kChecked>(x, first_word, at);
      const unsigned token = entry >> 24, over = std::max(token, first) - first;
      unsigned bits = over >> 3;
      uint32_t v = (8 + (over & 7)) << bits;
      if (bits > 15) [[unlikely]] {
        v += (x & ((1u << (bits - 15)) - 1)) << 15;
        x >>= bits - 15, bits = 15;
        good &= refill<kChecked>(x, first_word, at);
      }
      v += x & ((1u << bits) - 1);
      x >>= bits;
      good &= refill<kChecked>(x, first_word, at);
      tokens[i] = static_cast<uint8_t>(token);
      z[i] = v - 8;
      state = x;
    }
    end = at;
    return good;
  }
  uint32_t states_[kStates];
  size_t next_ = 0;
};

}  // namespace telesplat::codec::detail
