#include "common/codec/dense/symbols.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace telesplat::codec::detail {
namespace {

constexpr unsigned kBiasBits = 13, kShiftBits = 4;

ContextRows rows_around(const SymbolPlane& plane, size_t y, size_t begin) {
  const auto row = static_cast<ptrdiff_t>(y);
  return {plane.tokens.row(row - 1) + begin, plane.tokens.row(row - 2) + begin,
          plane.other != nullptr ? plane.other->row(row) + begin : nullptr};
}

bool has_kinds(const SymbolPlane& plane) { return plane.first != 0; }

void make_contexts(SymbolPlane& plane, const TileShape& shape, size_t y) {
  const auto row = static_cast<ptrdiff_t>(y);
  const auto [begin, end] = shape.span(y);
  uint8_t* const out = plane.contexts.row(row) + begin;
  if (has_kinds(plane))
    kernels().plane_contexts(plane.kinds.row(row - 1) + begin, end - begin, plane.scale.merges, out);
  else
    kernels().contexts(rows_around(plane, y, begin), end - begin, plane.scale, out);
}

}  // namespace

void TileShape::reset(size_t tile_width, size_t tile_height, const Mask* tile_mask) {
  width = tile_width, height = tile_height, mask = tile_mask;
  covered.assign(height, static_cast<uint32_t>(width));
  total = width * height;
  if (mask == nullptr) return;
  total = 0;
  runs.clear(), first_run.assign(1, 0);
  cover_bytes.reset(width, height);
  for (size_t y = 0; y < height; ++y) {
    const uint64_t* const words = mask->row(static_cast<int>(y));
    uint32_t n = 0;
    for (size_t w = 0; w < mask->words_per_row(); ++w) n += image::set_bits(words[w]);
    covered[y] = n, total += n;
    if (n != width) {
      kernels().cover_bytes(words, width, cover_bytes.row(static_cast<ptrdiff_t>(y)));
      if (n != 0) add_runs(words);
    }
    first_run.push_back(static_cast<uint32_t>(runs.size()));
  }
  find_spans();
}

void TileShape::add_runs(const uint64_t* words) {
  const auto end = static_cast<uint32_t>(width);
  uint32_t begin = end;  // of the run that has not ended
  for (uint32_t at = 0; at < end; at += 64) {
    uint64_t changes = words[at / 64] ^ (words[at / 64] << 1 | uint64_t{begin != end});
    for (; changes != 0; changes &= changes - 1) {
      const uint32_t x = at + static_cast<uint32_t>(std::countr_zero(changes));
      if (begin == end)
        begin = x;
      else
        runs.push_back({begin, x}), begin = end;
    }
  }
  if (begin != end) runs.push_back({begin, end});
}

void TileShape::find_spans() {
  constexpr size_t kBlock = 64, kReach = 2, kMore = 8;  // rows and columns
  spans.resize(height), spans_around.resize(height);
  for (size_t y = 0; y < height; ++y) {
    spans[y] = {0, full(y) ? width : 0};
    if (!full(y) && covered[y] != 0)
      spans[y] = {runs[first_run[y]].begin / kBlock * kBlock, runs[first_run[y + 1] - 1].end};
  }
  for (size_t y = 0; y < height; ++y) {
    Span& all = spans_around[y];
    all = {width, 0};
    for (size_t i = y < kReach ? 0 : y - kReach; i < std::min(height, y + kReach + 1); ++i) {
      if (covered[i] == 0) continue;
      all.begin = std::min(all.begin, spans[i].begin), all.end = std::max(all.end, spans[i].end);
    }
    all = all.end == 0 ? Span{0, 0} : Span{all.begin - std::min(all.begin, kMore), std::min(width, all.end + kMore)};
  }
}

void SymbolPlane::reset(const TileShape& shape, bool are_wide, unsigned first_number) {
  is_wide = are_wide, first = first_number, other = nullptr, scale = {}, has_contexts = false;
  alphabet = first + (is_wide ? kNumberTokens : kByteTokens);
  tokens.reset(shape.width, shape.height);
  contexts.reset(shape.width, shape.height);
  if (is_wide)
    wide.reset(shape.width, shape.height);
  else
    narrow.reset(shape.width, shape.height);
  tokens.fill_row(-1, 0), tokens.fill_row(-2, 0);
  if (!has_kinds(*this)) return;
  kinds.reset(shape.width, shape.height);
  kinds.fill_row(-1, 0);
}

void States::reset(const TileShape& shape) {
  count = states_of(shape.total);
  std::fill_n(of, kMostStates, kStateLow);
}

bool States::at_rest() const {
  return std::all_of(of, of + count, [](uint32_t x) { return x == kStateLow; });
}

size_t States::stored(const TileShape& shape, bool any_words) const {
  return any_words || !at_rest() ? std::min(count, shape.width) : 0;
}

void States::put(const TileShape& shape, uint8_t* out) const { std::memcpy(out, of, 4 * stored(shape, true)); }

bool States::get(std::span<const uint8_t> bytes) {
  if (!bytes.empty()) std::memcpy(of, bytes.data(), bytes.size());
  return std::all_of(of, of + count, [](uint32_t x) { return x >= kStateLow && x < kStateLow << 16; });
}

void WordSource::start(std::span<const uint8_t> words, size_t after, const uint8_t* before) {
  constexpr size_t kBeyond = 64, kLead = 16 * kLanes;  // bytes
  readable = before, end = words.data() + words.size();
  if (after >= kBeyond) return;
  copy_.assign(kLead + words.size() + kBeyond, 0);
  if (!words.empty()) std::memcpy(copy_.data() + kLead, words.data(), words.size());
  readable = copy_.data(), end = copy_.data() + kLead + words.size();
}

void finish_tokens(SymbolPlane& plane, const TileShape& shape, size_t y) {
  uint8_t* const row = plane.tokens.row(static_cast<ptrdiff_t>(y));
  const uint8_t* const above = plane.tokens.row(static_cast<ptrdiff_t>(y) - 1);
  if (const uint8_t* const cover = shape.cover(y); cover != nullptr)
    kernels().keep_bytes(cover, above, shape.width, row);
  row[-1] = row[0], row[shape.width] = row[shape.width - 1];
  if (has_kinds(plane)) kernels().plane_kinds(row, shape.width + 1, plane.kinds.row(static_cast<ptrdiff_t>(y)));
}

double rough_bits(const SymbolPlane& plane, const TileShape& shape) {
  std::array<uint32_t, kSymbols> counts{};
  uint64_t raw = 0;
  for (size_t y = 0; y < shape.height; y += 4) {
    const uint8_t* const tokens = plane.tokens.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape.width; ++x) {
      if (!shape.at(x, y)) continue;
      ++counts[tokens[x]];
      raw += tokens[x] < plane.first ? 0 : (tokens[x] - plane.first) >> 3;
    }
  }
  return static_cast<double>(raw) + bits_of(counts, kSymbols);
}

// The finest classes that nearly all sums fit into.
void PlaneEncoder::choose_scale(SymbolPlane& plane, const TileShape& shape) {
  constexpr size_t kMostSum = 16 * (kNumberTokens - 1);  // of a number's tokens with weights 3, 2, 2, 1 and 4, 2, 2
  constexpr uint32_t kEnough = 500;
  std::array<uint32_t, kMostSum + 1> histogram{};
  uint32_t total = 0;
  // Every so many pixels that are covered, of every so many rows.
  const auto sample = [&](size_t first_row, size_t rows, size_t pixels) {
    histogram.fill(0), total = 0;
    for (size_t y = first_row, left = 0; y < shape.height; y += rows) {
      const ContextRows around = rows_around(plane, y, 0);
      const uint8_t *a = around.above, *b = around.above2, *o = around.other;
      shape.for_each_run(y, [&](size_t x, size_t end) {
        for (x += left; x < end; x += pixels, ++total)
          ++histogram[static_cast<size_t>(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x] +
                                          (o == nullptr ? 0 : 4 * o[x] + 2 * o[x - 1] + 2 * o[x + 1]))];
        left = x - end;
      });
    }
  };
  sample(1, 16, 3);
  if (total < kEnough) sample(1, 5, 2);
  if (total < kEnough) sample(0, 1, 1);
  size_t low = 0, high = histogram.size() - 1;
  for (uint32_t seen = 0; low < high && seen + histogram[low] <= total / 32; ++low) seen += histogram[low];
  for (uint32_t seen = 0; high > low && seen + histogram[high] <= total / 32; --high) seen += histogram[high];
  int shift = 0;
  while ((high - low + 1) >> shift > kContexts) ++shift;
  plane.scale = {static_cast<int>(low) - (1 << shift >> 1), shift};
  plane.scale.bias = std::max(plane.scale.bias, 0);
}

// In four tables, so that equal symbols side by side need not wait for each other. None has more than 65535.
void PlaneEncoder::count(SymbolPlane& plane, const TileShape& shape) {
  for (auto& part : parts_)
    for (size_t c = 0; c < kContexts; ++c) std::fill_n(part + c * kSymbols, plane.alphabet, uint16_t{0});
  symbols_.reset(shape.width, shape.height);
  if (joined_.size() < shape.width + Plane<uint16_t>::kTail) joined_.resize(shape.width + Plane<uint16_t>::kTail);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [first, last] = shape.span(y);
    uint16_t *const row = symbols_.row(r), *const joined = shape.full(y) ? row : joined_.data();
    if (!plane.has_contexts) make_contexts(plane, shape, y);
    kernels().join_bytes(plane.tokens.row(r) + first, plane.contexts.row(r) + first, last - first, joined + first);
    if (!shape.full(y)) kernels().pack_shorts(shape.words(y), joined, last, row);
    const size_t n = shape.covered[y];
    size_t x = 0;
    for (; x + 4 <= n; x += 4) {
      uint64_t four;
      std::memcpy(&four, row + x, 8);
      ++parts_[0][four & 0xFFFF], ++parts_[1][four >> 16 & 0xFFFF], ++parts_[2][four >> 32 & 0xFFFF],
          ++parts_[3][four >> 48];
    }
    for (; x < n; ++x) ++parts_[x % 4][row[x]];
  }
  for (size_t c = 0; c < kContexts; ++c)
    for (size_t t = 0; t < plane.alphabet; ++t) {
      const size_t i = c * kSymbols + t;
      counts_[c][t] = uint32_t{parts_[0][i]} + parts_[1][i] + parts_[2][i] + parts_[3][i];
    }
}

void PlaneEncoder::prepare(SymbolPlane& plane, const TileShape& shape, BitSink& bits) {
  if (!plane.has_contexts && !has_kinds(plane)) choose_scale(plane, shape);
  count(plane, shape);
  if (!plane.has_contexts) plane.scale.merges = merge_contexts(counts_, plane.alphabet);
  choose_levels(counts_, plane.alphabet, levels_);
  if (!has_kinds(plane)) {
    bits.put(static_cast<uint64_t>(plane.scale.bias), kBiasBits);
    bits.put(static_cast<uint64_t>(plane.scale.shift), kShiftBits);
  }
  bits.put(static_cast<uint64_t>(plane.scale.merges), 3);
  put_levels(bits, levels_);
  make_encode_tables(levels_, tables_, plane.scale.merges);
}

uint8_t* PlaneEncoder::put_row(const SymbolPlane& plane, const TileShape& shape, size_t y, States& states,
                               uint8_t* out) {
  const auto r = static_cast<ptrdiff_t>(y);
  SymbolRow row{.symbols = symbols_.row(r), .count = shape.covered[y], .first = plane.first, .states = states.count};
  row.wide = plane.is_wide ? plane.wide.row(r) : nullptr;
  row.narrow = plane.is_wide ? nullptr : plane.narrow.row(r);
  if (!shape.full(y)) {
    const size_t end = shape.span(y).end, needed = shape.width + Plane<uint8_t>::kTail;
    if (packed_narrow_.size() < needed) packed_narrow_.resize(needed), packed_wide_.resize(needed);
    if (plane.is_wide) {
      kernels().pack_wide(shape.words(y), row.wide, end, packed_wide_.data());
      row.wide = packed_wide_.data();
    } else {
      kernels().pack_bytes(shape.words(y), row.narrow, end, packed_narrow_.data());
      row.narrow = packed_narrow_.data();
    }
  }
  return kernels().put_symbols(row, tables_.data(), states.of, out);
}

bool PlaneDecoder::prepare(SymbolPlane& plane, BitReader& bits) {
  if (!has_kinds(plane)) {
    plane.scale.bias = static_cast<int>(bits.source.take(kBiasBits));
    plane.scale.shift = static_cast<int>(bits.source.take(kShiftBits));
  }
  plane.scale.merges = static_cast<int>(bits.source.take(3));
  levels_.alphabet = plane.alphabet;
  if (bits.overrun() || plane.scale.shift > 14 || plane.scale.merges > (plane.has_contexts ? 0 : 4)) return false;
  if (!get_levels(bits, levels_)) return false;
  make_decode_tables(levels_, tables_, kContexts >> plane.scale.merges);
  return true;
}

bool PlaneDecoder::get_row(SymbolPlane& plane, const TileShape& shape, size_t y, WordSource& source) {
  const auto r = static_cast<ptrdiff_t>(y);
  uint8_t *const contexts = plane.contexts.row(r), *const tokens = plane.tokens.row(r);
  uint32_t* const wide = plane.is_wide ? plane.wide.row(r) : nullptr;
  uint8_t* const narrow = plane.is_wide ? nullptr : plane.narrow.row(r);
  if (!plane.has_contexts) make_contexts(plane, shape, y);
  if (shape.full(y)) {
    source.end = kernels().get_symbols(
        {contexts, tokens, wide, narrow, shape.width, plane.first, source.states.count, source.readable},
        tables_.data(), source.states.of, source.begin, source.end);
    finish_tokens(plane, shape, y);
    return source.end != nullptr;
  }
  const size_t needed = shape.width + Plane<uint8_t>::kTail;
  if (packed_tokens_.size() < needed)
    packed_tokens_.resize(needed), packed_contexts_.resize(needed), packed_narrow_.resize(needed),
        packed_wide_.resize(needed);
  const uint64_t* const words = shape.words(y);
  kernels().pack_bytes(words, contexts, shape.width, packed_contexts_.data());
  source.end = kernels().get_symbols(
      {packed_contexts_.data(), packed_tokens_.data(), wide != nullptr ? packed_wide_.data() : nullptr,
       packed_narrow_.data(), shape.covered[y], plane.first, source.states.count, source.readable},
      tables_.data(), source.states.of, source.begin, source.end);
  if (source.end == nullptr) return false;
  kernels().unpack_bytes(words, packed_tokens_.data(), shape.width, tokens);
  if (wide != nullptr)
    kernels().unpack_wide(words, shape.cover(y), packed_wide_.data(), shape.width, wide);
  else
    kernels().unpack_bytes(words, packed_narrow_.data(), shape.width, narrow);
  finish_tokens(plane, shape, y);
  return true;
}

}  // namespace telesplat::codec::detail
