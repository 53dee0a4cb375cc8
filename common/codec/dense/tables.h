// Frequencies of a plane's tokens, by context, and their coding in streams.
//
// Each token's frequency is sent as a level, four a factor of two: level 0 is "never", 1 the least frequency, others
// weigh 2^((level - 2) / 4) quarters more. Levels are coded as differences from predictions, by Golomb's codes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/codec/dense/rans.h"
#include "common/codec/entropy.h"

namespace telesplat::codec::detail {

inline constexpr int kLevels = 60;

/// Levels of the tokens of each context. In contexts without tokens all levels are 0.
struct TokenLevels {
  std::array<std::array<uint8_t, kSymbols>, kContexts> of;
  unsigned alphabet = 0;  ///< tokens are below it
};

/// Number of occurrences of each token, by context.
using TokenCounts = std::array<std::array<uint32_t, kSymbols>, kContexts>;

/// Least bits for tokens with these counts, plus roughly the bits of their table.
double bits_of(const std::array<uint32_t, kSymbols>& counts, unsigned alphabet);
/// Chooses how many times neighbouring contexts are merged, and adds their counts up: 16 >> merges contexts remain.
int merge_contexts(TokenCounts& counts, unsigned alphabet);

/// The levels that suit `counts` best, with the bits that it takes to send them.
void choose_levels(const TokenCounts& counts, unsigned alphabet, TokenLevels& levels);

/// Appends levels; at most kMostLevelBits follow.
void put_levels(BitSink& bits, const TokenLevels& levels);
inline constexpr size_t kMostLevelBits = kContexts * kSymbols * 64;
/// False: the bits give no valid levels for this alphabet.
[[nodiscard]] bool get_levels(BitReader& bits, TokenLevels& levels);

/// Frequencies for levels: their sum is kFrequencyOne, or 0 if all levels are 0.
void frequencies_of(const std::array<uint8_t, kSymbols>& levels, unsigned alphabet,
                    std::array<uint16_t, kSymbols>& out);

/// Makes kContexts x kSymbols entries.
void make_encode_tables(const TokenLevels& levels, std::vector<EncodeEntry>& out);
/// Makes kFrequencyOne entries for each of the first `contexts`: token << 24 | (frequency - 1) << 12 | offset. Contexts
/// without tokens give token 0.
void make_decode_tables(const TokenLevels& levels, std::vector<uint32_t>& out, size_t contexts = kContexts);

}  // namespace telesplat::codec::detail
