// The coder of symbols by itself: what it puts comes back, on every instruction set, in as many bits as it should take.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/tables.h"
#include "tests/support/simd_targets.h"

namespace telesplat::codec::detail {
namespace {

struct Symbols {
  std::vector<uint8_t> tokens, contexts, narrow;
  std::vector<uint32_t> wide;
  TokenLevels levels;
  std::vector<EncodeEntry> encode;
  std::vector<uint32_t> decode;
  double entropy_bits = 0;
};

// Numbers below 2^most_bits, most of them small.
Symbols make_symbols(size_t n, bool wide, unsigned most_bits, uint32_t seed) {
  std::mt19937 random(seed);
  Symbols s;
  const size_t padded = n + 64;
  s.tokens.resize(padded), s.contexts.resize(padded), s.narrow.resize(padded), s.wide.resize(padded);
  TokenCounts counts{};
  for (size_t i = 0; i < n; ++i) {
    s.contexts[i] = static_cast<uint8_t>(random() % kContexts);
    const unsigned bits = std::min(most_bits, static_cast<unsigned>(random() % 3 == 0 ? random() % 25 : s.contexts[i]));
    s.wide[i] = random() & ((1u << bits) - 1);
    s.narrow[i] = static_cast<uint8_t>(s.wide[i]);
    if (!wide) s.wide[i] = s.narrow[i];
    s.tokens[i] = static_cast<uint8_t>(token_of(s.wide[i]));
    ++counts[s.contexts[i]][s.tokens[i]];
  }
  choose_levels(counts, wide ? kNumberTokens : kByteTokens, s.levels);
  make_encode_tables(s.levels, s.encode);
  make_decode_tables(s.levels, s.decode);
  for (const auto& of : counts) {
    double total = 0;
    for (const uint32_t c : of) total += c;
    for (uint32_t t = 0; t < kSymbols; ++t)
      if (of[t] != 0) s.entropy_bits += of[t] * (std::log2(total / of[t]) + (t >> 3));
  }
  return s;
}

std::vector<uint8_t> put(const Kernels& kernels, const Symbols& s, size_t n, bool wide, size_t count,
                         uint32_t* states) {
  std::fill_n(states, kMostStates, kStateLow);
  std::vector<uint8_t> out(n * 6 + 64);
  std::vector<uint16_t> symbols(n);
  for (size_t i = 0; i < n; ++i) symbols[i] = static_cast<uint16_t>(s.contexts[i] * kSymbols + s.tokens[i]);
  const SymbolRow row{symbols.data(), wide ? s.wide.data() : nullptr, s.narrow.data(), n, 0, count};
  out.resize(static_cast<size_t>(kernels.put_symbols(row, s.encode.data(), states, out.data()) - out.data()));
  return out;
}

void expect_symbols(const Kernels& kernels, const Symbols& s, size_t n, bool wide, const std::vector<uint8_t>& bytes,
                    size_t count, const uint32_t* from) {
  alignas(64) uint32_t states[kMostStates];
  std::copy_n(from, kMostStates, states);
  std::vector<uint8_t> padded = bytes, tokens(n + 64), narrow(n + 64);
  std::vector<uint32_t> numbers(n + 64);
  padded.resize(bytes.size() + 64);
  const DecodedRow row{s.contexts.data(), tokens.data(), wide ? numbers.data() : nullptr, narrow.data(), n, 0, count};
  const uint8_t* const begin = padded.data();
  ASSERT_EQ(kernels.get_symbols(row, s.decode.data(), states, begin, begin + bytes.size()), begin);
  for (size_t i = 0; i < n; ++i) {
    ASSERT_EQ(tokens[i], s.tokens[i]) << i;
    ASSERT_EQ(wide ? numbers[i] : narrow[i], s.wide[i]) << i;
  }
  for (const uint32_t x : states) ASSERT_EQ(x, kStateLow);
}

TEST(Rans, AnySymbolsComeBackOnEveryInstructionSet) {
  for (uint32_t seed = 0; seed < 120; ++seed) {
    const size_t n = 1 + seed * 37 % 200;
    const bool wide = seed % 2 != 0;
    const Symbols s = make_symbols(n, wide, wide ? 24 : 8, seed);
    alignas(64) uint32_t states[kMostStates], others[kMostStates];
    const size_t count = seed % 4 < 2 ? kLanes : kMostStates;
    const auto bytes = put(plain_kernels(), s, n, wide, count, states);
    expect_symbols(plain_kernels(), s, n, wide, bytes, count, states);
    for (const int64_t target : kernel_targets()) {
      const testing::OnTarget on(target);
      ASSERT_EQ(put(kernels(), s, n, wide, count, others), bytes) << hwy::TargetName(target);
      ASSERT_TRUE(std::equal(states, states + kMostStates, others)) << hwy::TargetName(target);
      expect_symbols(kernels(), s, n, wide, bytes, count, states);
    }
  }
}

TEST(Rans, TakesWhatItsSymbolsCarry) {
  constexpr size_t kCount = 60000;
  const Symbols s = make_symbols(kCount, true, 24, 3);
  alignas(64) uint32_t states[kMostStates];
  const double bits = 8.0 * static_cast<double>(put(kernels(), s, kCount, true, kMostStates, states).size());
  EXPECT_LT(bits, s.entropy_bits * 1.015);
  EXPECT_GT(bits + 32 * kMostStates, s.entropy_bits);
}

TEST(Rans, WordsThatAreMissingAreFound) {
  const Symbols s = make_symbols(500, true, 24, 5);
  alignas(64) uint32_t states[kMostStates], copy[kMostStates];
  std::vector<uint8_t> tokens(564);
  std::vector<uint32_t> numbers(564);
  const auto check = [&](const Kernels& kernels, size_t count) {
    const auto bytes = put(kernels, s, 500, true, count, states);
    for (size_t cut = 2; cut < bytes.size(); cut += 2)
      for (const size_t lead : {0, 64, 1000}) {  // bytes before them that may be read
        std::vector<uint8_t> padded(lead);
        padded.insert(padded.end(), bytes.begin() + static_cast<ptrdiff_t>(cut), bytes.end());
        padded.resize(padded.size() + 64);
        std::copy_n(states, kMostStates, copy);
        const DecodedRow row{s.contexts.data(), tokens.data(), numbers.data(), nullptr, 500, 0, count, padded.data()};
        const uint8_t *const begin = padded.data() + lead, *const end = padded.data() + padded.size() - 64;
        ASSERT_EQ(kernels.get_symbols(row, s.decode.data(), copy, begin, end), nullptr) << cut;
      }
  };
  for (const size_t count : {kLanes, kMostStates}) {
    check(plain_kernels(), count);
    for (const int64_t target : kernel_targets()) {
      SCOPED_TRACE(hwy::TargetName(target));
      const testing::OnTarget on(target);
      check(kernels(), count);
    }
  }
}

TEST(Tables, ComeBackAndAddUp) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Symbols s = make_symbols(1 + seed * 400, true, 24, seed);
    BitWriter writer;
    writer.start(kMostLevelBits);
    put_levels(writer.sink, s.levels);
    BitReader reader;
    reader.start(writer.bytes(), 1024);
    TokenLevels back;
    back.alphabet = s.levels.alphabet;
    ASSERT_TRUE(get_levels(reader, back));
    ASSERT_EQ(back.of, s.levels.of);
    std::array<uint16_t, kSymbols> frequencies;
    for (const auto& of : back.of) {
      frequencies_of(of, back.alphabet, frequencies);
      uint32_t sum = 0;
      for (const uint16_t f : frequencies) sum += f;
      ASSERT_TRUE(sum == kFrequencyOne || sum == 0) << sum;
    }
  }
}

TEST(Tables, DamagedOnesAreRefusedOrAddUp) {
  std::mt19937 random(8);
  int accepted = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    std::vector<uint8_t> bytes(1 + random() % 300);
    for (uint8_t& b : bytes) b = static_cast<uint8_t>(random() & (trial % 2 != 0 ? 255 : 0x11));
    BitReader reader;
    reader.start(bytes, 1024);
    TokenLevels levels;
    levels.alphabet = kNumberTokens;
    if (!get_levels(reader, levels)) continue;
    ++accepted;
    std::vector<uint32_t> tables;
    make_decode_tables(levels, tables);
    for (const uint32_t entry : tables) ASSERT_LT(entry >> 24, kNumberTokens);
  }
  EXPECT_GT(accepted, 0);
}

TEST(Reciprocals, DivideExactly) {
  std::mt19937 random(2);
  for (uint32_t f = 1; f <= kFrequencyOne; ++f) {
    const uint32_t start = random() % (kFrequencyOne - f + 1);
    const EncodeEntry e = EncodeEntry::of(start, f);
    for (int i = 0; i < 20; ++i) {
      const uint64_t most = std::min<uint64_t>(uint64_t{f} << (kStateBits - kFrequencyBits), uint64_t{1} << 31) - 1;
      const auto x = static_cast<uint32_t>(i == 0 ? most : kStateLow + random() % (most - kStateLow + 1));
      const uint32_t shift = e.packed >> EncodeEntry::kShiftAt & EncodeEntry::kShiftMask;
      const uint32_t quotient = static_cast<uint32_t>(uint64_t{x} * e.reciprocal >> 32) >> shift;
      ASSERT_EQ(x + (e.packed & EncodeEntry::kAddMask) + quotient * (e.packed >> EncodeEntry::kComplementAt),
                x / f * kFrequencyOne + x % f + start)
          << x << " / " << f;
    }
  }
}

}  // namespace
}  // namespace telesplat::codec::detail
