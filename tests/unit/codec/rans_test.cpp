// The coder of symbols alone: symbols come back, in as many bits as they should take.
#include "common/codec/dense/rans.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/codec/dense/tables.h"

namespace telesplat::codec::detail {
namespace {

struct Symbols {
  std::vector<uint8_t> tokens, contexts;
  std::vector<uint32_t> z;
  TokenLevels levels;
  std::vector<EncodeEntry> encode;
  std::vector<uint32_t> decode;
  double entropy_bits = 0;
};

// Numbers below 2^most_bits, mostly small.
Symbols make_symbols(size_t n, unsigned most_bits, uint32_t seed) {
  std::mt19937 random(seed);
  Symbols s;
  TokenCounts counts{};
  for (size_t i = 0; i < n; ++i) {
    s.contexts.push_back(static_cast<uint8_t>(random() % kContexts));
    const unsigned bits = std::min(most_bits, static_cast<unsigned>(random() % 3 == 0 ? random() % 25 : s.contexts[i]));
    s.z.push_back(random() & ((1u << bits) - 1));
    s.tokens.push_back(static_cast<uint8_t>(token_of(s.z[i])));
    ++counts[s.contexts[i]][s.tokens[i]];
  }
  choose_levels(counts, most_bits > 8 ? kNumberTokens : kByteTokens, s.levels);
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

// Returns words, and the states behind them.
std::vector<uint8_t> put(const Symbols& s) {
  std::vector<uint8_t> out(s.z.size() * kMostSymbolBytes + kStateBytes);
  SymbolEncoder coder;
  coder.start(s.z.size(), out.data());
  for (size_t i = s.z.size(); i-- > 0;)
    coder.put(s.encode[s.contexts[i] * kSymbols + s.tokens[i]], s.z[i], s.tokens[i] >> 3);
  out.resize(static_cast<size_t>(coder.end() - out.data()) + kStateBytes);
  coder.put_states(out.data() + out.size() - kStateBytes);
  return out;
}

// False if words are missing. Takes symbols in parts, like rows.
bool get(const Symbols& s, const std::vector<uint8_t>& bytes, std::vector<uint8_t>& tokens, std::vector<uint32_t>& z,
         bool& rests) {
  SymbolDecoder coder;
  coder.begin = bytes.data(), coder.end = coder.begin + bytes.size() - kStateBytes;
  if (!coder.start(coder.end)) return false;
  tokens.assign(s.z.size(), 0), z.assign(s.z.size(), 0);
  for (size_t at = 0; at < z.size(); at += 70)
    if (!coder.get(s.decode.data(), s.contexts.data() + at, std::min<size_t>(70, z.size() - at), 0, tokens.data() + at,
                   z.data() + at))
      return false;
  rests = coder.at_rest() && coder.end == coder.begin;
  return true;
}

TEST(Rans, AnySymbolsComeBack) {
  for (uint32_t seed = 0; seed < 120; ++seed) {
    const Symbols s = make_symbols(1 + seed * 37 % 700, seed % 2 != 0 ? 24 : 8, seed);
    std::vector<uint8_t> tokens;
    std::vector<uint32_t> z;
    bool rests = false;
    ASSERT_TRUE(get(s, put(s), tokens, z, rests));
    EXPECT_EQ(tokens, s.tokens);
    EXPECT_EQ(z, s.z);
    EXPECT_TRUE(rests);
  }
}

TEST(Rans, TakesWhatItsSymbolsCarry) {
  const Symbols s = make_symbols(60000, 24, 3);
  const double bits = 8.0 * static_cast<double>(put(s).size());
  EXPECT_LT(bits, s.entropy_bits * 1.015);
  EXPECT_GT(bits, s.entropy_bits);
}

TEST(Rans, WordsThatAreMissingAreFound) {
  const Symbols s = make_symbols(500, 24, 5);
  const auto bytes = put(s);
  std::vector<uint8_t> tokens;
  std::vector<uint32_t> z;
  for (size_t cut = 2; cut <= bytes.size() - kStateBytes; cut += 2) {
    bool rests = false;
    ASSERT_FALSE(get(s, {bytes.begin() + static_cast<ptrdiff_t>(cut), bytes.end()}, tokens, z, rests)) << cut;
  }
}

TEST(Rans, StatesOutOfRangeAreRefused) {
  uint8_t states[kStateBytes] = {};
  EXPECT_FALSE(SymbolDecoder().start(states)) << "below 2^15";
  EXPECT_TRUE(SymbolDecoder().start(nullptr)) << "at rest";
}

TEST(Tables, ComeBackAndAddUp) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Symbols s = make_symbols(1 + seed * 400, 24, seed);
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

TEST(Tables, SlotsAreThoseOfEachToken) {
  const Symbols s = make_symbols(3000, 24, 4);
  std::array<uint16_t, kSymbols> frequencies;
  for (size_t c = 0; c < kContexts; ++c) {
    frequencies_of(s.levels.of[c], s.levels.alphabet, frequencies);
    size_t at = c * kFrequencyOne;
    for (uint32_t t = 0; t < kSymbols; ++t)
      for (uint32_t i = 0; i < frequencies[t]; ++i, ++at)
        ASSERT_EQ(s.decode[at], t << 24 | (frequencies[t] - 1u) << 12 | i) << at;
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

}  // namespace
}  // namespace telesplat::codec::detail
