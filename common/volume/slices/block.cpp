#include "common/volume/slices/block.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/codec/dense/symbols.h"
#include "common/codec/entropy.h"
#include "common/core/check.h"

namespace telesplat::volume {
namespace {

using namespace codec::detail;

constexpr size_t kSide = kBlockSide, kPlanes = 4, kGroupWidth = 16, kGroupHeight = 4;
constexpr std::array<size_t, kPlanes> kOrder{3, 1, 0, 2};  // bytes of a pixel, in the order of coding
constexpr size_t kMaskBytes = 8, kHead = kMaskBytes + kStateBytes, kMostBytes = 65535;

// Residuals and tokens of a block; planes are in the order of kOrder.
struct Symbols {
  Symbols() {
    for (auto& p : tokens) {
      p.reset(kSide, kSide);
      for (ptrdiff_t y = -Plane<uint8_t>::kRows; y < static_cast<ptrdiff_t>(kSide); ++y) p.fill_row(y, 0);
    }
  }
  uint64_t mask = 0;
  std::array<Plane<uint8_t>, kPlanes> tokens;
  uint32_t z[kPlanes][kSide][kSide];
};

// Adds or subtracts the bytes of two words, each separately.
uint32_t add(uint32_t a, uint32_t b) {
  constexpr uint32_t kHigh = 0x80808080u;
  return ((a & ~kHigh) + (b & ~kHigh)) ^ ((a ^ b) & kHigh);
}
uint32_t subtract(uint32_t a, uint32_t b) {
  constexpr uint32_t kHigh = 0x80808080u;
  return ((a | kHigh) - (b & ~kHigh)) ^ ((a ^ ~b) & kHigh);
}
uint64_t group_of(size_t x, size_t y) { return uint64_t{1} << (y / kGroupHeight * 4 + x / kGroupWidth); }

void split(const uint32_t* pixels, Symbols& s) {
  static constexpr uint32_t kNothing[kSide] = {};
  s.mask = 0;
  for (size_t y = 0; y < kSide; ++y) {
    const uint32_t *row = pixels + y * kSide, *above = y > 0 ? row - kSide : kNothing;
    uint8_t d[kPlanes][kSide];
    uint32_t before = 0;
    for (size_t x = 0; x < kSide; ++x) {
      const uint32_t rise = subtract(row[x], above[x]), residual = subtract(rise, before);
      before = rise;
      for (size_t c = 0; c < kPlanes; ++c) d[c][x] = static_cast<uint8_t>(residual >> (8 * c));
    }
    for (size_t p = 0; p < kPlanes; ++p) {
      const size_t c = kOrder[p];
      uint32_t* const z = s.z[p][y];
      for (size_t x = 0; x < kSide; ++x) {
        z[x] = fold(static_cast<int8_t>(c == 0 || c == 2 ? d[c][x] - d[1][x] : d[c][x]));
        if (z[x] != 0) s.mask |= group_of(x, y);
      }
      tokens_of(z, kSide, s.tokens[p].row(static_cast<ptrdiff_t>(y)));
    }
  }
}

void join(const Symbols& s, uint32_t* pixels) {
  static constexpr uint32_t kNothing[kSide] = {};
  for (size_t y = 0; y < kSide; ++y) {
    uint32_t* row = pixels + y * kSide;
    const uint32_t* above = y > 0 ? row - kSide : kNothing;
    uint8_t d[kPlanes][kSide];
    for (size_t p = 0; p < kPlanes; ++p)
      for (size_t x = 0; x < kSide; ++x) d[kOrder[p]][x] = static_cast<uint8_t>(unfold(s.z[p][y][x]));
    uint32_t rise = 0;
    for (size_t x = 0; x < kSide; ++x) {
      const uint8_t green = d[1][x];
      const uint32_t residual = static_cast<uint8_t>(d[0][x] + green) | uint32_t{green} << 8 |
                                uint32_t{static_cast<uint8_t>(d[2][x] + green)} << 16 | uint32_t{d[3][x]} << 24;
      rise = add(rise, residual);
      row[x] = add(above[x], rise);
    }
  }
}

ContextRows rows_around(const Symbols& s, size_t p, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  return {s.tokens[p].row(r - 1), s.tokens[p].row(r - 2), p > 0 ? s.tokens[p - 1].row(r) : nullptr};
}

// Calls f with the begins of the mask's groups in a row.
template <class F>
void for_each_group(uint64_t mask, size_t y, F f) {
  for (unsigned left = static_cast<unsigned>(mask >> (y / kGroupHeight * 4)) & 15; left != 0; left &= left - 1)
    f(static_cast<size_t>(std::countr_zero(left)) * kGroupWidth);
}

}  // namespace

struct BlockCoder::Parts {
  std::vector<std::unique_ptr<Symbols>> blocks;
  size_t count = 0;
  std::array<ContextScale, kPlanes> scales;
  std::array<std::vector<EncodeEntry>, kPlanes> tables;
  std::vector<uint8_t> words;

  // Calls f(begin, contexts of the row, tokens) for the mask's groups of a row.
  template <class F>
  void for_each_row_group(const Symbols& s, size_t p, size_t y, F f) const {
    uint8_t contexts[kSide + Plane<uint8_t>::kTail];
    make_contexts(rows_around(s, p, y), kSide, scales[p], contexts);
    const uint8_t* const tokens = s.tokens[p].row(static_cast<ptrdiff_t>(y));
    for_each_group(s.mask, y, [&](size_t x) { f(x, contexts + x, tokens + x); });
  }

  void choose_scale(size_t p) {
    std::vector<uint32_t> sums(size_t{1} << kBiasBits);
    uint32_t total = 0;
    for (size_t n = 0; n < count; ++n)
      for (size_t y = n % 3; y < kSide; y += 3) {
        const ContextRows rows = rows_around(*blocks[n], p, y);
        for_each_group(blocks[n]->mask, y, [&](size_t first) {
          for (size_t x = first; x < first + kGroupWidth; x += 2, ++total) ++sums[static_cast<size_t>(rows.sum(x))];
        });
      }
    scales[p] = scale_of(sums, total);
  }
};

BlockCoder::BlockCoder() : parts_(std::make_unique<Parts>()) {}
BlockCoder::~BlockCoder() = default;

void BlockCoder::start() { parts_->count = 0; }

void BlockCoder::add(const uint32_t* pixels) {
  Parts& s = *parts_;
  if (s.blocks.size() == s.count) s.blocks.push_back(std::make_unique<Symbols>());
  split(pixels, *s.blocks[s.count++]);
}

void BlockCoder::put_tables(std::vector<uint8_t>& out) {
  Parts& s = *parts_;
  BitWriter writer;
  writer.start(kPlanes * (kBiasBits + kShiftBits + kMostLevelBits));
  auto counts = std::make_unique<TokenCounts>();
  for (size_t p = 0; p < kPlanes; ++p) {
    s.choose_scale(p);
    for (auto& c : *counts) c.fill(0);
    for (size_t n = 0; n < s.count; ++n)
      for (size_t y = 0; y < kSide; ++y)
        s.for_each_row_group(*s.blocks[n], p, y, [&](size_t, const uint8_t* contexts, const uint8_t* tokens) {
          for (size_t i = 0; i < kGroupWidth; ++i) ++(*counts)[contexts[i]][tokens[i]];
        });
    TokenLevels levels;
    choose_levels(*counts, kByteTokens, levels);
    writer.sink.put(static_cast<uint64_t>(s.scales[p].bias), kBiasBits);
    writer.sink.put(static_cast<uint64_t>(s.scales[p].shift), kShiftBits);
    put_levels(writer.sink, levels);
    make_encode_tables(levels, s.tables[p]);
  }
  const auto bytes = writer.bytes();
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void BlockCoder::put(size_t n, std::vector<uint8_t>& out) {
  Parts& s = *parts_;
  const Symbols& block = *s.blocks[n];
  const size_t symbols = kPlanes * kGroupWidth * kGroupHeight * static_cast<size_t>(std::popcount(block.mask));
  s.words.resize(std::max(s.words.size(), symbols * kMostSymbolBytes + 2));
  SymbolEncoder coder;
  coder.start(symbols, s.words.data());
  for (size_t p = kPlanes; p-- > 0;)
    for (size_t y = kSide; y-- > 0;) {
      struct Symbol {
        uint32_t z;
        uint8_t context, token;
      } row[kSide];
      size_t count = 0;
      s.for_each_row_group(block, p, y, [&](size_t x, const uint8_t* contexts, const uint8_t* tokens) {
        for (size_t i = 0; i < kGroupWidth; ++i) row[count++] = {block.z[p][y][x + i], contexts[i], tokens[i]};
      });
      while (count-- > 0)
        coder.put(s.tables[p][row[count].context * kSymbols + row[count].token], row[count].z,
                  unsigned{row[count].token} >> 3);
    }
  const size_t begin = out.size();
  out.resize(begin + kHead);
  std::memcpy(out.data() + begin, &block.mask, kMaskBytes);
  coder.put_states(out.data() + begin + kMaskBytes);
  out.insert(out.end(), s.words.data(), coder.end());
  CHECK(out.size() - begin <= kMostBytes);
}

struct BlockDecoder::Parts {
  std::array<ContextScale, kPlanes> scales;
  std::array<std::vector<uint32_t>, kPlanes> tables;
  SymbolDecoder coder;
  Symbols symbols;

  // Takes row y of plane p, those before being known. False where words are missing.
  bool get_row(size_t p, size_t y) {
    uint8_t* const tokens = symbols.tokens[p].row(static_cast<ptrdiff_t>(y));
    uint32_t* const z = symbols.z[p][y];
    std::fill_n(tokens, kSide, uint8_t{0});
    std::fill_n(z, kSide, 0u);
    uint8_t contexts[kSide + Plane<uint8_t>::kTail];
    make_contexts(rows_around(symbols, p, y), kSide, scales[p], contexts);
    bool good = true;
    for_each_group(symbols.mask, y, [&](size_t x) {
      good = good && coder.get(tables[p].data(), contexts + x, kGroupWidth, 0, tokens + x, z + x);
    });
    return good;
  }
};

BlockDecoder::BlockDecoder() : parts_(std::make_unique<Parts>()) {}
BlockDecoder::~BlockDecoder() = default;

Status BlockDecoder::set_tables(std::span<const uint8_t> tables) {
  Parts& s = *parts_;
  BitReader reader;
  reader.start(tables, kPlanes * (kBiasBits + kShiftBits) + kMostLevelBits);
  for (size_t p = 0; p < kPlanes; ++p) {
    s.scales[p] = {};
    s.scales[p].bias = static_cast<int>(reader.source.take(kBiasBits));
    s.scales[p].shift = static_cast<int>(reader.source.take(kShiftBits));
    auto levels = std::make_unique<TokenLevels>();
    levels->alphabet = kByteTokens;
    if (reader.overrun() || s.scales[p].shift > kMostShift || !get_levels(reader, *levels))
      return Error{fmt::format("tables of {} bytes that are not valid", tables.size())};
    make_decode_tables(*levels, s.tables[p]);
  }
  return ok_status();
}

Status BlockDecoder::decode(std::span<const uint8_t> bytes, uint32_t* pixels) {
  Parts& s = *parts_;
  if (bytes.size() < kHead || bytes.size() % 2 != 0)
    return Error{fmt::format("a block of {} bytes, expected an even number and at least {}", bytes.size(), kHead)};
  std::memcpy(&s.symbols.mask, bytes.data(), kMaskBytes);
  if (!s.coder.start(bytes.data() + kMaskBytes)) return Error{"a block with a state that is out of range"};
  s.coder.begin = bytes.data() + kHead, s.coder.end = bytes.data() + bytes.size();
  for (size_t p = 0; p < kPlanes; ++p)
    for (size_t y = 0; y < kSide; ++y)
      if (!s.get_row(p, y)) return Error{"a block that ends too early"};
  if (s.coder.end != s.coder.begin || !s.coder.at_rest()) return Error{"a block with more in it than its pixels"};
  join(s.symbols, pixels);
  return ok_status();
}

}  // namespace telesplat::volume
