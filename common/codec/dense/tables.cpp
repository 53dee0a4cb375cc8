#include "common/codec/dense/tables.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

// In 256ths of a frequency, beyond the 1 that every token has.
uint32_t weight_of(unsigned level) {
  static constexpr uint32_t kSteps[4] = {64, 76, 91, 108};
  return level < 2 ? 0 : kSteps[(level - 2) & 3] << ((level - 2) >> 2);
}

// The level whose weight is nearest, by ratio.
unsigned level_of(uint32_t weight) {
  if (weight < 32) return 1;
  const int octave = static_cast<int>(std::bit_width(weight)) - 7;  // of 64 and more: 0 and more
  unsigned level = octave < 0 ? 2 : 2 + 4 * static_cast<unsigned>(octave);
  while (level + 1 < kLevels &&
         uint64_t{weight} * weight >= uint64_t{weight_of(level)} * weight_of(level + 1))  // above their geometric mean
    ++level;
  return level;
}

// What a level is expected to be: from the token before and, but for the first context, what that context has.
struct Expected {
  const std::array<uint8_t, kSymbols>* before;
  int left = 0, left2 = 0;
  int operator()(unsigned token) const {
    if (before == nullptr) return token < 8 ? left : (left + left2 + 1) / 2;
    const int slope = token == 0 ? (*before)[0] : (*before)[token] - (*before)[token - 1] / 2 - (token > 1 ? (*before)[token - 2] / 2 : (*before)[token - 1] / 2);
    const int base = token == 0 ? 0 : token == 1 ? left : (left + left2) / 2;
    return std::clamp((base + slope + (token == 0 ? 0 : (*before)[token])) / (token == 0 ? 1 : 2), 0, kLevels - 1);
  }
  void next(int level) { left2 = left, left = level; }
};

constexpr uint32_t kFirstMean = 4;

// Walks the levels alike for both directions: code(difference, context) -> difference; false ends it.
template <class Code>
bool for_each_level(TokenLevels& levels, Code code) {
  GolombContext lengths, first, later;
  lengths.start(8), first.start(kFirstMean), later.start(kFirstMean);
  const std::array<uint8_t, kSymbols>* before = nullptr;
  int length = 0;  // tokens up to the last one that has a level
  for (auto& of : levels.of) {
    int own = static_cast<int>(levels.alphabet);
    while (own > 0 && of[static_cast<size_t>(own - 1)] == 0) --own;
    own = length + code(own - length, lengths);
    if (own < 0 || own > static_cast<int>(levels.alphabet)) return false;
    Expected expected{before};
    for (int t = 0; t < own; ++t) {
      const int guess = expected(static_cast<unsigned>(t));
      const int level = guess + code(int{of[static_cast<size_t>(t)]} - guess, before == nullptr ? first : later);
      if (level < 0 || level >= kLevels) return false;
      of[static_cast<size_t>(t)] = static_cast<uint8_t>(level);
      expected.next(level);
    }
    if (own == 0) continue;
    if (of[static_cast<size_t>(own - 1)] == 0) return false;
    length = own, before = &of;
  }
  return true;
}

}  // namespace

void choose_levels(const TokenCounts& counts, unsigned alphabet, TokenLevels& levels) {
  levels.alphabet = alphabet;
  for (size_t c = 0; c < kContexts; ++c) {
    uint64_t total = 0;
    uint32_t present = 0;
    for (unsigned t = 0; t < alphabet; ++t) total += counts[c][t], present += counts[c][t] != 0;
    levels.of[c].fill(0);
    if (total == 0) continue;
    for (unsigned t = 0; t < alphabet; ++t) {
      if (counts[c][t] == 0) continue;
      const uint64_t share = uint64_t{counts[c][t]} * kFrequencyOne * 256 / total;  // of a frequency, in 256ths
      levels.of[c][t] = static_cast<uint8_t>(level_of(share < 256 ? 0 : static_cast<uint32_t>(share - 256)));
    }
    if (present == 1) std::replace_if(levels.of[c].begin(), levels.of[c].end(), [](uint8_t l) { return l != 0; }, 2);
  }
}

void put_levels(BitSink& bits, const TokenLevels& levels) {
  TokenLevels copy = levels;
  for_each_level(copy, [&](int difference, GolombContext& context) { return context.put(difference, bits), difference; });
}

bool get_levels(BitReader& bits, TokenLevels& levels) {
  for (auto& of : levels.of) of.fill(0);
  return for_each_level(levels, [&](int, GolombContext& context) {
    return bits.overrun() ? int{kSymbols} * 8 : context.get(bits.source);
  }) && !bits.overrun();
}

void frequencies_of(const std::array<uint8_t, kSymbols>& levels, unsigned alphabet,
                    std::array<uint16_t, kSymbols>& out) {
  out.fill(0);
  uint64_t total = 0;
  uint32_t present = 0;
  unsigned last = 0;
  for (unsigned t = 0; t < alphabet; ++t)
    if (levels[t] != 0) total += weight_of(levels[t]), ++present, last = t;
  if (present == 0) return;
  const uint64_t free = kFrequencyOne - present;
  uint64_t sum = 0, given = 0;
  for (unsigned t = 0; t < alphabet; ++t) {
    if (levels[t] == 0) continue;
    sum += weight_of(levels[t]);
    const uint64_t upto = total == 0 ? 0 : sum * free / total;
    out[t] = static_cast<uint16_t>(1 + upto - given);
    given = upto;
  }
  out[last] = static_cast<uint16_t>(out[last] + free - given);  // where all weigh nothing
}

void make_encode_tables(const TokenLevels& levels, std::vector<EncodeEntry>& out) {
  out.resize(kContexts * kSymbols);
  std::array<uint16_t, kSymbols> frequencies;
  for (size_t c = 0; c < kContexts; ++c) {
    frequencies_of(levels.of[c], levels.alphabet, frequencies);
    uint32_t start = 0;
    for (unsigned t = 0; t < levels.alphabet; start += frequencies[t++])
      out[c * kSymbols + t] = EncodeEntry::of(start, frequencies[t]);
  }
}

void make_decode_tables(const TokenLevels& levels, std::vector<uint32_t>& out) {
  out.resize(kContexts * kFrequencyOne);
  std::array<uint16_t, kSymbols> frequencies;
  for (size_t c = 0; c < kContexts; ++c) {
    frequencies_of(levels.of[c], levels.alphabet, frequencies);
    uint32_t* at = out.data() + c * kFrequencyOne;
    uint32_t* const end = at + kFrequencyOne;
    for (unsigned t = 0; t < levels.alphabet; ++t)
      for (uint32_t i = 0, f = frequencies[t]; i < f; ++i) *at++ = t << 24 | (f - 1) << 12 | i;
    for (uint32_t i = 0; at != end; ++i) *at++ = (kFrequencyOne - 1) << 12 | i;  // a context without tokens
  }
}

}  // namespace telesplat::codec::detail
