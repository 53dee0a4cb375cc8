#include "common/codec/dense/symbols.h"

#include <algorithm>
#include <bit>

namespace telesplat::codec::detail {
namespace {

ContextRows rows_around(const SymbolPlane& plane, size_t y) {
  const auto row = static_cast<ptrdiff_t>(y);
  return {plane.tokens.row(row - 1), plane.tokens.row(row - 2),
          plane.other != nullptr ? plane.other->row(row) : nullptr};
}

bool has_kinds(const SymbolPlane& plane) { return plane.first != 0; }

void find_contexts(SymbolPlane& plane, const TileShape& shape, size_t y) {
  const auto row = static_cast<ptrdiff_t>(y);
  uint8_t* const out = plane.contexts.row(row);
  if (!has_kinds(plane)) return make_contexts(rows_around(plane, y), shape.width, plane.scale, out);
  const uint8_t* const above = plane.kinds.row(row - 1);
  for (size_t x = 0; x < shape.width; ++x)
    out[x] = static_cast<uint8_t>(kPlaneContexts[size_t{above[x]} * 16 + above[x + 1]] >> plane.scale.merges);
}

// Chooses the scale from a sample of covered pixels.
ContextScale choose_scale(const SymbolPlane& plane, const TileShape& shape) {
  constexpr size_t kMostSum = 16 * (kNumberTokens - 1);  // a number's tokens with weights 3, 2, 2, 1, 4, 2, 2
  constexpr uint32_t kEnough = 500;
  std::vector<uint32_t> sums;
  uint32_t total = 0;
  const auto sample = [&](size_t first_row, size_t rows, size_t pixels) {
    sums.assign(kMostSum + 1, 0), total = 0;
    for (size_t y = first_row, left = 0; y < shape.height; y += rows) {
      const ContextRows around = rows_around(plane, y);
      shape.for_each_run(y, [&](size_t x, size_t end) {
        for (x += left; x < end; x += pixels, ++total) ++sums[static_cast<size_t>(around.sum(x))];
        left = x - end;
      });
    }
  };
  sample(1, 16, 3);
  if (total < kEnough) sample(1, 5, 2);
  if (total < kEnough) sample(0, 1, 1);
  return scale_of(sums, total);
}

}  // namespace

ContextScale scale_of(std::span<const uint32_t> sums, uint32_t total) {
  size_t low = 0, high = sums.size() - 1;
  for (uint32_t seen = 0; low < high && seen + sums[low] <= total / 32; ++low) seen += sums[low];
  for (uint32_t seen = 0; high > low && seen + sums[high] <= total / 32; --high) seen += sums[high];
  int shift = 0;
  while ((high - low + 1) >> shift > kContexts) ++shift;
  return {.bias = std::max(static_cast<int>(low) - (1 << shift >> 1), 0), .shift = shift};
}

void TileShape::reset(size_t tile_width, size_t tile_height, const Mask* tile_mask) {
  width = tile_width, height = tile_height, mask = tile_mask;
  covered.assign(height, static_cast<uint32_t>(width));
  total = width * height;
  if (mask == nullptr) return;
  total = 0;
  runs.clear(), first_run.assign(1, 0);
  for (size_t y = 0; y < height; ++y) {
    const uint64_t* const words = mask->row(static_cast<int>(y));
    uint32_t n = 0;
    for (size_t w = 0; w < mask->words_per_row(); ++w) n += image::set_bits(words[w]);
    covered[y] = n, total += n;
    if (n != width) add_runs(words);
    first_run.push_back(static_cast<uint32_t>(runs.size()));
  }
}

void TileShape::add_runs(const uint64_t* words) {
  const auto end = static_cast<uint32_t>(width);
  uint32_t begin = end;  // begin of the current run; `end`: no run is open
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

void SymbolPlane::reset(const TileShape& shape, bool bytes, unsigned first_number) {
  first = first_number, other = nullptr, scale = {};
  alphabet = first + (bytes ? kByteTokens : kNumberTokens);
  for (Plane<uint8_t>* plane : {&tokens, &contexts, &kinds}) plane->reset(shape.width, shape.height);
  z.reset(shape.width, shape.height);
  tokens.fill_row(-1, 0), tokens.fill_row(-2, 0), kinds.fill_row(-1, 0);
}

void finish_tokens(SymbolPlane& plane, const TileShape& shape, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  uint8_t* const row = plane.tokens.row(r);
  const uint8_t* const above = plane.tokens.row(r - 1);
  if (!shape.full(y))
    shape.for_each_gap(y, [&](size_t begin, size_t end) { std::copy(above + begin, above + end, row + begin); });
  row[-1] = row[0], row[shape.width] = row[shape.width - 1];
  if (has_kinds(plane)) plane_kinds(row, shape.width + 1, plane.kinds.row(r));
}

void PlaneEncoder::prepare(SymbolPlane& plane, const TileShape& shape, BitSink& bits) {
  if (!has_kinds(plane)) plane.scale = choose_scale(plane, shape);
  for (auto& of : counts_) of.fill(0);
  for (size_t y = 0; y < shape.height; ++y) {
    find_contexts(plane, shape, y);
    const uint8_t *const tokens = plane.tokens.row(static_cast<ptrdiff_t>(y)), *const contexts = plane.contexts.row(
                                                                                   static_cast<ptrdiff_t>(y));
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) ++counts_[contexts[x]][tokens[x]];
    });
  }
  plane.scale.merges = merge_contexts(counts_, plane.alphabet);
  choose_levels(counts_, plane.alphabet, levels_);
  if (!has_kinds(plane)) {
    bits.put(static_cast<uint64_t>(plane.scale.bias), kBiasBits);
    bits.put(static_cast<uint64_t>(plane.scale.shift), kShiftBits);
  }
  bits.put(static_cast<uint64_t>(plane.scale.merges), 3);
  put_levels(bits, levels_);
  make_encode_tables(levels_, tables_);
}

void PlaneEncoder::put_row(const SymbolPlane& plane, const TileShape& shape, size_t y, SymbolEncoder& out) const {
  const auto r = static_cast<ptrdiff_t>(y);
  const uint8_t *const tokens = plane.tokens.row(r), *const contexts = plane.contexts.row(r);
  const uint32_t* const z = plane.z.row(r);
  const unsigned first = plane.first;
  SymbolEncoder coder = out;  // a local copy, which the written bytes cannot alias
  shape.for_each_run_back(y, [&](size_t begin, size_t x) {
    while (x-- > begin) {
      const unsigned token = tokens[x], bits = (std::max(token, first) - first) >> 3;
      coder.put(tables_[(size_t{contexts[x]} >> plane.scale.merges) * kSymbols + token], z[x], bits);
    }
  });
  out = coder;
}

bool PlaneDecoder::prepare(SymbolPlane& plane, BitReader& bits) {
  if (!has_kinds(plane)) {
    plane.scale.bias = static_cast<int>(bits.source.take(kBiasBits));
    plane.scale.shift = static_cast<int>(bits.source.take(kShiftBits));
  }
  plane.scale.merges = static_cast<int>(bits.source.take(3));
  levels_.alphabet = plane.alphabet;
  if (bits.overrun() || plane.scale.shift > kMostShift || plane.scale.merges > 4) return false;
  if (!get_levels(bits, levels_)) return false;
  make_decode_tables(levels_, tables_, kContexts >> plane.scale.merges);
  return true;
}

bool PlaneDecoder::get_row(SymbolPlane& plane, const TileShape& shape, size_t y, SymbolDecoder& source) const {
  const auto r = static_cast<ptrdiff_t>(y);
  find_contexts(plane, shape, y);
  bool good = true;
  shape.for_each_run(y, [&](size_t begin, size_t end) {
    good = good && source.get(tables_.data(), plane.contexts.row(r) + begin, end - begin, plane.first,
                              plane.tokens.row(r) + begin, plane.z.row(r) + begin);
  });
  finish_tokens(plane, shape, y);
  return good;
}

}  // namespace telesplat::codec::detail
