#include "common/codec/dense/tables.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

constexpr uint32_t kSteps[4] = {64, 76, 91, 108};  // weights of levels 2 to 5; every fourth level doubles

// The weight of a level, in 256ths of a frequency, beyond the 1 that every token has.
constexpr uint32_t weight_of(unsigned level) { return level < 2 ? 0 : kSteps[(level - 2) & 3] << ((level - 2) >> 2); }

// Returns the level whose weight is nearest, by ratio.
unsigned level_of(uint32_t weight) {
  // Nearest step by the seven bits after the highest one: counts the geometric means of neighbouring steps below it.
  static constexpr auto kNearest = [] {
    std::array<uint8_t, 128> out{};
    for (uint32_t i = 0; i < out.size(); ++i) {
      const uint32_t w = 2 * (128 + i) + 1;  // middle of the weights with these bits, in quarters of a step's unit
      for (uint32_t k = 0; k < 4; ++k) {
        const uint64_t next = k == 3 ? 2 * kSteps[0] : kSteps[k + 1];
        out[i] = static_cast<uint8_t>(out[i] + (uint64_t{w} * w >= 16 * kSteps[k] * next));
      }
    }
    return out;
  }();
  if (weight < 32) return 1;
  if (weight < 64) return 2;
  const auto bits = static_cast<unsigned>(std::bit_width(weight));
  const uint32_t after = (bits > 8 ? weight >> (bits - 8) : weight << (8 - bits)) & 127;
  return std::min(2 + 4 * (bits - 7) + kNearest[after], kLevels - 1u);
}

// Predicts a level from the tokens before it and, except in the first context, from the context before.
struct Expected {
  const std::array<uint8_t, kSymbols>* before;
  int left = 0, left2 = 0;
  int operator()(unsigned token) const {
    if (before == nullptr) return token < 8 ? left : (left + left2 + 1) / 2;
    const int slope = token == 0 ? (*before)[0]
                                 : (*before)[token] - (*before)[token - 1] / 2 -
                                       (token > 1 ? (*before)[token - 2] / 2 : (*before)[token - 1] / 2);
    const int base = token == 0 ? 0 : token == 1 ? left : (left + left2) / 2;
    return std::clamp((base + slope + (token == 0 ? 0 : (*before)[token])) / (token == 0 ? 1 : 2), 0, kLevels - 1);
  }
  void next(int level) { left2 = left, left = level; }
};

constexpr uint32_t kFirstMean = 4;

// Walks the levels, for both directions of coding: code(difference, context) -> difference. False: a level is invalid.
template <class Code>
bool for_each_level(TokenLevels& levels, Code code) {
  GolombContext lengths, first, later;
  lengths.start(8), first.start(kFirstMean), later.start(kFirstMean);
  const std::array<uint8_t, kSymbols>* before = nullptr;
  int length = 0;  // number of tokens up to the last with a level
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

constexpr unsigned kMostOfNone = 12;  // largest level of a token that does not occur
constexpr uint32_t kMany = 70;        // from this count on only the ideal level pays

// Bits of a level that is `steps` from its prediction.
constexpr int kMostStepsThatCost = 6;
constexpr float cost_of(int steps) { return 1.5f * static_cast<float>(std::min(steps, kMostStepsThatCost)); }

// The level between `ideal` and `expected` that costs the fewest bits: d steps away from the ideal one, `count` tokens
// cost 0.0216 d^2 bits more each.
int nearer_level(uint32_t count, int ideal, int expected) {
  constexpr float kLoss = 0.0216f;
  // Number of steps that pay, by count: one more costs (2 d + 1) kLoss count.
  static constexpr auto kThatPay = [] {
    std::array<uint8_t, kMany> out{};
    for (uint32_t n = 1; n < out.size(); ++n)
      while (out[n] < kLevels && static_cast<float>((2 * out[n] + 1) * n) * kLoss < cost_of(1)) ++out[n];
    return out;
  }();
  const int towards = std::max(expected, 1), most = std::abs(ideal - towards), apart = std::abs(ideal - expected);
  int d = std::min<int>(kThatPay[count], most);
  if (apart > kMostStepsThatCost) {  // below kMostStepsThatCost steps nothing is saved
    d = std::min(std::max(d, apart - kMostStepsThatCost), most);
    const float n = static_cast<float>(count), off = static_cast<float>(d);
    if (kLoss * n * off * off + cost_of(apart - d) >= cost_of(apart)) d = 0;
  }
  return towards < ideal ? ideal - d : ideal + d;
}

// The level of a token that does not occur: 0, or one near the prediction.
int level_of_none(uint64_t total, int expected) {
  static constexpr auto kWeights = [] {
    std::array<float, kMostOfNone + 1> out{};
    for (unsigned level = 1; level <= kMostOfNone; ++level) out[level] = 1 + static_cast<float>(weight_of(level)) / 256;
    return out;
  }();
  int best = 0;
  float least = cost_of(expected);
  const float loss_of_one = static_cast<float>(total) * (1.44f / kFrequencyOne);
  for (int level = 1; level <= std::min(expected, static_cast<int>(kMostOfNone)); ++level) {
    const float loss = kWeights[static_cast<size_t>(level)] * loss_of_one;
    if (loss >= least) break;
    if (const float cost = loss + cost_of(expected - level); cost < least) least = cost, best = level;
  }
  return best;
}

// The level of a token that occurs `count` times in `total`: near the prediction if few bits depend on it.
// share_of_one: frequency of one occurrence, in 256ths.
int choose_level(uint32_t count, uint64_t total, double share_of_one, int expected) {
  if (count == 0) return level_of_none(total, expected);
  const auto share = static_cast<uint32_t>(count * share_of_one);
  const int ideal = static_cast<int>(level_of(share < 256 ? 0 : share - 256));
  return count >= kMany ? ideal : nearer_level(count, ideal, expected);
}

constexpr double kTokenCost = 6;  // bits of a token's level in a table

// Returns n log2 n.
float entropy_of(uint32_t n) {
  static const auto table = [] {
    std::array<float, 4096> out{};
    for (uint32_t i = 1; i < out.size(); ++i) out[i] = static_cast<float>(i * std::log2(static_cast<double>(i)));
    return out;
  }();
  if (n < table.size()) return table[n];
  const int shift = static_cast<int>(std::bit_width(n)) - 12;
  const uint32_t top = n >> shift;
  return static_cast<float>(n) * (table[top] / static_cast<float>(top) + static_cast<float>(shift));
}

}  // namespace

double bits_of(const std::array<uint32_t, kSymbols>& counts, unsigned alphabet) {
  double sum = 0;
  uint32_t total = 0, present = 0;
  for (unsigned t = 0; t < alphabet; ++t)
    if (const uint32_t n = counts[t]; n != 0) total += n, ++present, sum -= static_cast<double>(entropy_of(n));
  return total == 0 ? 0 : sum + static_cast<double>(entropy_of(total)) + kTokenCost * present;
}

int merge_contexts(TokenCounts& counts, unsigned alphabet) {
  const auto comes = [&](unsigned token) {
    return std::any_of(counts.begin(), counts.end(), [&](const auto& c) { return c[token] != 0; });
  };
  while (alphabet > 0 && !comes(alphabet - 1)) --alphabet;
  double best = 0;
  for (const auto& c : counts) best += bits_of(c, alphabet);
  TokenCounts merged = counts;
  int merges = 0;
  for (int tried = 1; tried <= 4; ++tried) {
    double bits = 0;
    for (size_t c = 0; c < kContexts >> tried; ++c) {
      for (unsigned t = 0; t < alphabet; ++t) merged[c][t] = merged[2 * c][t] + merged[2 * c + 1][t];
      bits += bits_of(merged[c], alphabet);
    }
    for (size_t c = kContexts >> tried; c < kContexts; ++c) merged[c].fill(0);
    if (bits < best) best = bits, merges = tried, counts = merged;
  }
  return merges;
}

void choose_levels(const TokenCounts& counts, unsigned alphabet, TokenLevels& levels) {
  levels.alphabet = alphabet;
  const std::array<uint8_t, kSymbols>* before = nullptr;
  for (size_t c = 0; c < kContexts; ++c) {
    auto& of = levels.of[c];
    of.fill(0);
    uint64_t total = 0;
    unsigned present = 0, end = 0;
    for (unsigned t = 0; t < alphabet; ++t) {
      const bool comes = counts[c][t] != 0;
      total += counts[c][t], present += comes, end = comes ? t + 1 : end;
    }
    if (total == 0) continue;
    Expected expected{before};
    const double share = kFrequencyOne * 256.0 / static_cast<double>(total);
    for (unsigned t = 0; t < end; ++t) {
      of[t] = static_cast<uint8_t>(present == 1 ? (counts[c][t] != 0 ? 2 : 0)
                                                : choose_level(counts[c][t], total, share, expected(t)));
      expected.next(of[t]);
    }
    before = &of;
  }
}

void put_levels(BitSink& bits, const TokenLevels& levels) {
  TokenLevels copy = levels;
  BitSink sink = bits;
  for_each_level(copy,
                 [&](int difference, GolombContext& context) { return context.put(difference, sink), difference; });
  bits = sink;
}

bool get_levels(BitReader& bits, TokenLevels& levels) {
  for (auto& of : levels.of) of.fill(0);
  return for_each_level(levels,
                        [&](int, GolombContext& context) {
                          return bits.overrun() ? int{kSymbols} * 8 : context.get(bits.source);
                        }) &&
         !bits.overrun();
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
  const uint32_t free = kFrequencyOne - present;
  // Products are below 2^53, so that quotients of doubles are rounded down like those of integers, and divide faster.
  static_assert(uint64_t{kSymbols} * weight_of(kLevels - 1) * kFrequencyOne < uint64_t{1} << 53);
  uint64_t sum = 0;
  uint32_t given = 0;
  for (unsigned t = 0; t < alphabet; ++t) {
    if (levels[t] == 0) continue;
    sum += weight_of(levels[t]);
    const auto upto =
        total == 0 ? 0 : static_cast<uint32_t>(static_cast<double>(sum * free) / static_cast<double>(total));
    out[t] = static_cast<uint16_t>(1 + upto - given);
    given = upto;
  }
  out[last] = static_cast<uint16_t>(out[last] + free - given);  // if all weights are 0
}

void make_encode_tables(const TokenLevels& levels, std::vector<EncodeEntry>& out) {
  out.assign(kContexts * kSymbols, {});
  std::array<uint16_t, kSymbols> frequencies;
  for (size_t c = 0; c < kContexts; ++c) {
    frequencies_of(levels.of[c], levels.alphabet, frequencies);
    uint16_t start = 0;
    for (unsigned t = 0; t < levels.alphabet; start = static_cast<uint16_t>(start + frequencies[t++]))
      out[c * kSymbols + t] = {start, frequencies[t]};
  }
}

void make_decode_tables(const TokenLevels& levels, std::vector<uint32_t>& out, size_t contexts) {
  out.resize(kContexts * kFrequencyOne);
  std::array<uint16_t, kSymbols> frequencies;
  for (size_t c = 0; c < contexts; ++c) {
    frequencies_of(levels.of[c], levels.alphabet, frequencies);
    uint32_t *at = out.data() + c * kFrequencyOne, *const begin = at;
    for (uint32_t t = 0; t < levels.alphabet; ++t)
      for (uint32_t i = 0, count = frequencies[t]; i < count; ++i) *at++ = (t << 24 | (count - 1) << 12) + i;
    if (at == begin)  // a context without tokens
      for (uint32_t i = 0; i < kFrequencyOne; ++i) at[i] = (kFrequencyOne - 1) << 12 | i;
  }
}

}  // namespace telesplat::codec::detail
