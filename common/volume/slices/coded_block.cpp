#include "common/volume/slices/coded_block.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/plane.h"
#include "common/codec/dense/tables.h"
#include "common/codec/entropy.h"
#include "common/volume/slices/block.h"

namespace telesplat::volume {
namespace {

using namespace codec::detail;

constexpr size_t kSide = kBlockSide, kPlanes = 4, kGroupWidth = 16, kGroupHeight = 4;
constexpr std::array<size_t, kPlanes> kOrder{3, 1, 0, 2};  // bytes of a pixel, as they are coded
constexpr unsigned kBiasBits = 13, kShiftBits = 4;
constexpr size_t kStateBytes = 4 * kLanes, kHead = 1 + 8 + kStateBytes;
constexpr size_t kLead = 256;  // bytes before words, which lets kernels take whole groups of symbols to the end
constexpr size_t kMostWordBytes = kBlockPixels * kPlanes * 6 + 64;

const auto kTokens = [] {
  std::array<uint8_t, 256> table{};
  for (uint32_t z = 0; z < 256; ++z) table[z] = static_cast<uint8_t>(token_of(z));
  return table;
}();

// A block's residuals and tokens, planes in the order of kOrder.
struct Symbols {
  Symbols() {
    for (auto& p : tokens) {
      p.reset(kSide, kSide);
      for (ptrdiff_t y = -Plane<uint8_t>::kRows; y < static_cast<ptrdiff_t>(kSide); ++y) p.fill_row(y, 0);
    }
  }
  uint64_t mask = 0;
  std::array<Plane<uint8_t>, kPlanes> tokens;
  alignas(64) uint8_t z[kPlanes][kSide][kSide];
};

// Bytes of a word added or subtracted, each for itself.
uint32_t add(uint32_t a, uint32_t b) {
  constexpr uint32_t kHigh = 0x80808080u;
  return ((a & ~kHigh) + (b & ~kHigh)) ^ ((a ^ b) & kHigh);
}
uint32_t subtract(uint32_t a, uint32_t b) {
  constexpr uint32_t kHigh = 0x80808080u;
  return ((a | kHigh) - (b & ~kHigh)) ^ ((a ^ ~b) & kHigh);
}
uint8_t fold(uint8_t d) { return static_cast<uint8_t>(d << 1 ^ (d > 127 ? 0xff : 0)); }
uint8_t unfold(uint8_t z) { return static_cast<uint8_t>(z >> 1 ^ (z & 1 ? 0xff : 0)); }

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
      uint8_t *z = s.z[p][y], *tokens = s.tokens[p].row(static_cast<ptrdiff_t>(y));
      for (size_t x = 0; x < kSide; ++x)
        z[x] = fold(c == 0 || c == 2 ? static_cast<uint8_t>(d[c][x] - d[1][x]) : d[c][x]);
      for (size_t x = 0; x < kSide; ++x) tokens[x] = kTokens[z[x]];
      for (size_t x = 0; x < kSide; x += 8) {
        uint64_t eight;
        std::memcpy(&eight, z + x, 8);
        if (eight != 0) s.mask |= group_of(x, y);
      }
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
      for (size_t x = 0; x < kSide; ++x) d[kOrder[p]][x] = unfold(s.z[p][y][x]);
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

// Places of the mask's groups in a row.
template <class F>
void for_each_group(uint64_t mask, size_t y, F f) {
  for (unsigned left = static_cast<unsigned>(mask >> (y / kGroupHeight * 4)) & 15; left != 0; left &= left - 1)
    f(static_cast<size_t>(std::countr_zero(left)) * kGroupWidth);
}

// The finest classes that nearly all sums fit into.
ContextScale scale_of(const std::vector<uint32_t>& sums, uint32_t total) {
  size_t low = 0, high = sums.size() - 1;
  for (uint32_t seen = 0; low < high && seen + sums[low] <= total / 32; ++low) seen += sums[low];
  for (uint32_t seen = 0; high > low && seen + sums[high] <= total / 32; --high) seen += sums[high];
  int shift = 0;
  while ((high - low + 1) >> shift > kContexts) ++shift;
  ContextScale scale;
  scale.bias = std::max(static_cast<int>(low) - (1 << shift >> 1), 0);
  scale.shift = shift;
  return scale;
}

struct PackedRow {
  alignas(64) uint8_t contexts[kSide + Plane<uint8_t>::kTail], tokens[kSide + Plane<uint8_t>::kTail],
      narrow[kSide + Plane<uint8_t>::kTail];
  alignas(64) uint16_t symbols[kSide + Plane<uint8_t>::kTail];
  size_t count = 0;
};

}  // namespace

struct BlockCoder::Parts {
  std::vector<std::unique_ptr<Symbols>> blocks;
  size_t count = 0;
  std::array<ContextScale, kPlanes> scales;
  std::array<std::vector<EncodeEntry>, kPlanes> tables;
  std::vector<uint8_t> words;
  PackedRow packed;

  void pack(const Symbols& s, size_t p, size_t y) {
    alignas(64) uint8_t contexts[kSide + Plane<uint8_t>::kTail];
    kernels().contexts(rows_around(s, p, y), kSide, scales[p], contexts);
    packed.count = 0;
    const uint8_t* tokens = s.tokens[p].row(static_cast<ptrdiff_t>(y));
    for_each_group(s.mask, y, [&](size_t x) {
      std::memcpy(packed.contexts + packed.count, contexts + x, kGroupWidth);
      std::memcpy(packed.tokens + packed.count, tokens + x, kGroupWidth);
      std::memcpy(packed.narrow + packed.count, s.z[p][y] + x, kGroupWidth);
      packed.count += kGroupWidth;
    });
    kernels().join_bytes(packed.tokens, packed.contexts, packed.count, packed.symbols);
  }

  void choose_scale(size_t p) {
    std::vector<uint32_t> sums(size_t{1} << kBiasBits);
    uint32_t total = 0;
    for (size_t n = 0; n < count; ++n)
      for (size_t y = n % 3; y < kSide; y += 3) {
        const ContextRows r = rows_around(*blocks[n], p, y);
        const uint8_t *a = r.above, *b = r.above2, *o = r.other;
        for_each_group(blocks[n]->mask, y, [&](size_t first) {
          for (size_t x = first; x < first + kGroupWidth; x += 2, ++total)
            ++sums[static_cast<size_t>(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x] +
                                       (o == nullptr ? 0 : 4 * o[x] + 2 * o[x - 1] + 2 * o[x + 1]))];
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
      for (size_t y = 0; y < kSide; ++y) {
        s.pack(*s.blocks[n], p, y);
        for (size_t i = 0; i < s.packed.count; ++i)
          ++(*counts)[s.packed.symbols[i] / kSymbols][s.packed.symbols[i] % kSymbols];
      }
    TokenLevels levels;
    choose_levels(*counts, kByteTokens, levels);
    writer.sink.put(static_cast<uint64_t>(s.scales[p].bias), kBiasBits);
    writer.sink.put(static_cast<uint64_t>(s.scales[p].shift), kShiftBits);
    levels.alphabet = kByteTokens;
    put_levels(writer.sink, levels);
    make_encode_tables(levels, s.tables[p]);
  }
  const auto bytes = writer.bytes();
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void BlockCoder::put(size_t n, std::vector<uint8_t>& out) {
  Parts& s = *parts_;
  const Symbols& block = *s.blocks[n];
  alignas(64) uint32_t states[kLanes];
  std::fill_n(states, kLanes, kStateLow);
  if (s.words.size() < kMostWordBytes) s.words.resize(kMostWordBytes);
  uint8_t* at = s.words.data();
  for (size_t p = kPlanes; p-- > 0;)
    for (size_t y = kSide; y-- > 0;) {
      s.pack(block, p, y);
      if (s.packed.count == 0) continue;
      SymbolRow row;
      row.symbols = s.packed.symbols, row.narrow = s.packed.narrow;
      row.count = s.packed.count;
      at = kernels().put_symbols(row, s.tables[p].data(), states, at);
    }
  const size_t words = static_cast<size_t>(at - s.words.data()), begin = out.size();
  out.resize(begin + kHead + words);
  uint8_t* to = out.data() + begin;
  *to = kCoded;
  std::memcpy(to + 1, &block.mask, 8);
  std::memcpy(to + 9, states, kStateBytes);
  std::memcpy(to + kHead, s.words.data(), words);
}

struct BlockDecoder::Parts {
  std::array<ContextScale, kPlanes> scales;
  std::array<std::vector<uint32_t>, kPlanes> tables;
  std::vector<uint8_t> words;
  Symbols symbols;
  PackedRow packed;

  // Row y of plane p, those before being known. Returns what is left of the words; null where they are too few.
  const uint8_t* get_row(size_t p, size_t y, uint32_t* states, const uint8_t* begin, const uint8_t* end) {
    Symbols& s = symbols;
    uint8_t* tokens = s.tokens[p].row(static_cast<ptrdiff_t>(y));
    std::memset(tokens, 0, kSide);
    std::memset(s.z[p][y], 0, kSide);
    alignas(64) uint8_t contexts[kSide + Plane<uint8_t>::kTail];
    kernels().contexts(rows_around(s, p, y), kSide, scales[p], contexts);
    size_t n = 0;
    for_each_group(s.mask, y, [&](size_t x) {
      std::memcpy(packed.contexts + n, contexts + x, kGroupWidth);
      n += kGroupWidth;
    });
    if (n == 0) return end;
    DecodedRow row;
    row.contexts = packed.contexts, row.tokens = packed.tokens, row.narrow = packed.narrow, row.count = n;
    row.readable = words.data();
    end = kernels().get_symbols(row, tables[p].data(), states, begin, end);
    n = 0;
    for_each_group(s.mask, y, [&](size_t x) {
      std::memcpy(tokens + x, packed.tokens + n, kGroupWidth);
      std::memcpy(s.z[p][y] + x, packed.narrow + n, kGroupWidth);
      n += kGroupWidth;
    });
    return end;
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
    if (reader.overrun() || s.scales[p].shift > 14 || !get_levels(reader, *levels))
      return Error{fmt::format("tables of {} bytes that are none", tables.size())};
    make_decode_tables(*levels, s.tables[p]);
  }
  return ok_status();
}

Status BlockDecoder::decode(std::span<const uint8_t> bytes, uint32_t* pixels) {
  Parts& s = *parts_;
  if (bytes.size() < kHead || bytes[0] != kCoded)
    return Error{fmt::format("a coded block of {} bytes, at least {}", bytes.size(), kHead)};
  if (s.tables[0].empty()) return Error{"a coded block, and no tables before it"};
  std::memcpy(&s.symbols.mask, bytes.data() + 1, 8);
  alignas(64) uint32_t states[kLanes];
  std::memcpy(states, bytes.data() + 9, kStateBytes);
  for (const uint32_t x : states)
    if (x < kStateLow || x >= kStateLow << 16) return Error{fmt::format("a coded block with a state of {}", x)};
  const auto words = bytes.subspan(kHead);
  if (words.size() % 2 != 0) return Error{fmt::format("a coded block of {} bytes of words", words.size())};
  s.words.resize(kLead + words.size() + 128);  // kernels read beyond both ends
  std::memcpy(s.words.data() + kLead, words.data(), words.size());
  const uint8_t *begin = s.words.data() + kLead, *end = begin + words.size();
  for (size_t p = 0; p < kPlanes; ++p)
    for (size_t y = 0; y < kSide; ++y)
      if ((end = s.get_row(p, y, states, begin, end)) == nullptr) return Error{"a coded block that ends too early"};
  if (end != begin || std::any_of(states, states + kLanes, [](uint32_t x) { return x != kStateLow; }))
    return Error{"a coded block with more in it than its pixels"};
  join(s.symbols, pixels);
  return ok_status();
}

}  // namespace telesplat::volume
