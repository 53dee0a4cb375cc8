// Frequencies of a plane's tokens, by context, and how streams carry them.
//
// Each token's frequency is sent as a level, four a factor of two: level 0 is "never", 1 the least frequency, others
// weigh 2^((level - 2) / 4) quarters more. Levels are coded as what they differ from those before, by Golomb's codes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/codec/dense/rans.h"
#include "common/codec/entropy.h"

namespace telesplat::codec::detail {

inline constexpr int kLevels = 60;

/// Levels of the tokens of each context. Contexts without tokens have none.
struct TokenLevels {
  std::array<std::array<uint8_t, kSymbols>, kContexts> of;
  unsigned alphabet = 0;  ///< tokens are below it
};

/// How often each token came.
using TokenCounts = std::array<std::array<uint32_t, kSymbols>, kContexts>;

/// Bits that tokens take at best which come that often, and roughly what their table takes.
double bits_of(const std::array<uint32_t, kSymbols>& counts, unsigned alphabet);
/// How many times neighbouring contexts should share tables: adds their counts up, so that 16 >> merges contexts are
/// left.
int merge_contexts(TokenCounts& counts, unsigned alphabet);

/// The levels that suit `counts` best, what it takes to send them included.
void choose_levels(const TokenCounts& counts, unsigned alphabet, TokenLevels& levels);

/// Appends levels; at most kMostLevelBits follow.
void put_levels(BitSink& bits, const TokenLevels& levels);
inline constexpr size_t kMostLevelBits = kContexts * kSymbols * 64;
/// False where they are no levels of an alphabet of that size.
[[nodiscard]] bool get_levels(BitReader& bits, TokenLevels& levels);

/// Frequencies that levels stand for: their sum is kFrequencyOne, or 0 where all levels are.
void frequencies_of(const std::array<uint8_t, kSymbols>& levels, unsigned alphabet,
                    std::array<uint16_t, kSymbols>& out);

/// kContexts x kSymbols entries.
void make_encode_tables(const TokenLevels& levels, std::vector<EncodeEntry>& out);
/// kFrequencyOne entries for each of the first `contexts`: token << 24 | (frequency - 1) << 12 | offset. Contexts
/// without tokens give token 0.
void make_decode_tables(const TokenLevels& levels, std::vector<uint32_t>& out, size_t contexts = kContexts);

}  // namespace telesplat::codec::detail
