#include "common/codec/dense/guided.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kConstantBits = 28;
// The sum of weights' sizes of which all sums but the left neighbour's, with residuals, are below 2^31.
constexpr int kTame = 100000;

int median_of(int left, int up, int corner) {
  return left + up - std::clamp(corner, std::min(left, up), std::max(left, up));
}

// Values of one plane, each from the one to its left: the longest chain of a decoder. So predictions and values are
// bounded, which changes few, only where kBounded; else good() says afterwards whether all lay within bounds. Bytes are
// 64ths and mod 256.
template <bool kByte, bool kBounded>
struct Chain {
  static constexpr int kBits = kByte ? GuidedPlane::kNormalBits : GuidedPlane::kIndexBits;
  static constexpr int kShift = kBits + 13;
  static constexpr int64_t kRound = int64_t{1} << (kShift - 1);

  Chain(GuidedPlane& guided, size_t y)
      : plane(guided),
        value(guided.values.row(static_cast<ptrdiff_t>(y))),
        residual(plane.residuals.row(static_cast<ptrdiff_t>(y))),
        sums(plane.sums.data()),
        weight(plane.weights[0] * (1 << kBits)),
        left(value[-1] >> kBits) {}
  void step(size_t x) { step(x, weight, 0); }
  // Unsigned: what lies far out of bounds grows, and wraps.
  void step(size_t x, int64_t near_weight, uint64_t rest) {
    uint64_t known = static_cast<uint64_t>(int64_t{sums[x]}) + rest;
    if (kBounded && !plane.has_residuals) known += static_cast<uint64_t>(int64_t{residual[x]} * (1 << 13) + kRound);
    left = static_cast<int64_t>(known + product(near_weight, left)) >> kShift;
    if constexpr (kBounded) {
      const int64_t off = residual[x] >> kBits;
      const bool plain = static_cast<uint64_t>(left - off) <= static_cast<uint64_t>(plane.most) &&
                         static_cast<uint64_t>(left) <= static_cast<uint64_t>(kByte ? 255 : plane.most);
      if (!plain) [[unlikely]]
        left = bounded(left - off, off);
    } else {
      seen |= left;
    }
    value[x] = static_cast<int16_t>(left << kBits);
  }
  bool good(const TileShape& shape, size_t y) const {
    if (kBounded) return true;
    const int64_t above = (int64_t{1} << (15 - kBits)) - 1;
    const auto [begin, end] = shape.span(y);
    return (seen & ~(kByte ? 255 : above)) == 0 &&
           kernels().within(shape.full(y) ? nullptr : shape.cover(y) + begin, value + begin, residual + begin,
                            end - begin, plane.most << kBits, (kByte ? 255 : plane.most) << kBits);
  }
  void begin(size_t x) { left = value[static_cast<ptrdiff_t>(x) - 1] >> kBits; }

  int64_t bounded(int64_t guess, int64_t off) const {
    const int64_t next = std::clamp<int64_t>(guess, 0, plane.most) + off;
    return kByte ? next & 255 : std::clamp<int64_t>(next, 0, plane.most);
  }
  static uint64_t product(int64_t a, int64_t b) { return static_cast<uint64_t>(a) * static_cast<uint64_t>(b); }

  const GuidedPlane& plane;
  int16_t* const value;
  const int16_t* const residual;
  const int32_t* const sums;
  const int64_t weight;
  int64_t left, seen = 0;
};

// The same where each flatness has weights of its own.
template <bool kBounded>
struct FlatChain {
  FlatChain(GuidedPlane& guided, size_t y)
      : plain(guided, y),
        flatness(guided.flatness->row(static_cast<ptrdiff_t>(y))),
        far(plain.value[-2] >> plain.kBits) {
    for (int k = 0; k < kFlatnesses; ++k)
      near_weight[k] = guided.sets[k][0] * (1 << 6), far_weight[k] = guided.sets[k][kFarLeft] * (1 << 6);
  }
  void step(size_t x) {
    const size_t k = flatness[x];
    const int64_t before = plain.left;
    plain.step(x, near_weight[k], plain.product(far_weight[k], far));
    far = before;
  }
  void begin(size_t x) {
    plain.begin(x);
    far = plain.value[static_cast<ptrdiff_t>(x) - 2] >> plain.kBits;
  }

  bool good(const TileShape& shape, size_t y) const { return plain.good(shape, y); }

  Chain<true, kBounded> plain;
  const uint8_t* const flatness;
  int64_t near_weight[kFlatnesses], far_weight[kFlatnesses];
  int64_t far;
};

// Values of a plane that the median predicts: of those to the left, above and between, which is exact where two facets
// meet.
template <bool kByte>
struct MedianChain {
  MedianChain(GuidedPlane& guided, size_t y)
      : plane(guided),
        value(guided.values.row(static_cast<ptrdiff_t>(y))),
        above(guided.values.row(static_cast<ptrdiff_t>(y) - 1)),
        residual(guided.residuals.row(static_cast<ptrdiff_t>(y))),
        left(value[-1]) {}
  void step(size_t x) {
    const int next = median_of(left, above[x], above[x - 1]) + residual[x];
    left = kByte ? next & 255 * 64 : std::clamp(next, 0, plane.most << plane.bits);
    value[x] = static_cast<int16_t>(left);
  }
  void begin(size_t x) { left = value[static_cast<ptrdiff_t>(x) - 1]; }
  bool good(const TileShape&, size_t) const { return true; }

  const GuidedPlane& plane;
  int16_t* const value;
  const int16_t *const above, *const residual;
  int left;
};

// False where good() is.
template <class Chain>
bool run(Chain chain, const TileShape& shape, size_t y) {
  shape.for_each_run(y, [&](size_t x, size_t end) {
    for (chain.begin(x); x < end; ++x) chain.step(x);
  });
  return chain.good(shape, y);
}

// Two that need not wait for each other.
template <class Chain>
bool run_both(Chain first, Chain second, const TileShape& shape, size_t y) {
  shape.for_each_run(y, [&](size_t x, size_t end) {
    for (first.begin(x), second.begin(x); x < end; ++x) first.step(x), second.step(x);
  });
  return first.good(shape, y) && second.good(shape, y);
}

// Normals and an index.
using ByteChain = Chain<true, false>;
using IndexChain = Chain<false, false>;
bool run_three(ByteChain first, ByteChain second, IndexChain third, const TileShape& shape, size_t y) {
  shape.for_each_run(y, [&](size_t x, size_t end) {
    first.begin(x), second.begin(x), third.begin(x);
    for (; x < end; ++x) first.step(x), second.step(x), third.step(x);
  });
  return first.good(shape, y) && second.good(shape, y) && third.good(shape, y);
}

bool is_plain(const GuidedPlane& plane) { return !plane.median && !plane.wild && plane.flatness == nullptr; }

template <bool kByte>
void decode_alone(GuidedPlane& plane, const TileShape& shape, size_t y) {
  if (plane.median) {
    run(MedianChain<kByte>(plane, y), shape, y);
    return;
  }
  const bool flat = plane.flatness != nullptr;
  if (!plane.wild)
    plane.wild = !(flat ? run(FlatChain<false>(plane, y), shape, y) : run(Chain<kByte, false>(plane, y), shape, y));
  if (plane.wild) flat ? run(FlatChain<true>(plane, y), shape, y) : run(Chain<kByte, true>(plane, y), shape, y);
}

}  // namespace

int16_t GuidedPlane::nearest_value(int16_t by) const {
  return static_cast<int16_t>(std::clamp((by + (1 << bits >> 1)) >> bits, 0, most) << bits);
}

void GuidedPlane::reset(const TileShape& shape, int fraction, int largest) {
  bits = fraction, most = largest, flatness = nullptr, wild = has_residuals = false, most_weight_ = 0;
  for (Plane<int16_t>* plane : {&values, &guide, &residuals}) plane->reset(shape.width, shape.height);
  symbols.reset(shape, bits != 6);
  sums.resize(std::max(sums.size(), shape.width + 64));
}

void GuidedPlane::begin(const TileShape& shape) {
  const size_t w = shape.width;
  const auto h = static_cast<ptrdiff_t>(shape.height);
  for (ptrdiff_t y = 0; y < h; ++y) guide.row(y)[-1] = guide.row(y)[0], guide.row(y)[w] = guide.row(y)[w - 1];
  std::copy_n(guide.row(0) - 1, w + 2, guide.row(-1) - 1);
  std::copy_n(guide.row(h - 1) - 1, w + 2, guide.row(h) - 1);
  std::transform(guide.row(0) - 1, guide.row(0) + w + 1, values.row(-1) - 1,
                 [&](int16_t by) { return nearest_value(by); });
  std::copy_n(values.row(-1) - 1, w + 2, values.row(-2) - 1);
}

void GuidedPlane::finish_row(const TileShape& shape, size_t y) {
  int16_t* const row = values.row(static_cast<ptrdiff_t>(y));
  const int16_t* const by = guide.row(static_cast<ptrdiff_t>(y));
  if (const uint8_t* const cover = shape.cover(y); cover != nullptr) {
    const auto [begin, end] = shape.around(y);
    kernels().fill_values(cover + begin, by + begin, end - begin, bits, most, row + begin);
  }
  row[-2] = row[-1] = nearest_value(by[-1]), row[shape.width] = nearest_value(by[shape.width]);
}

GuidedRows GuidedPlane::rows_around(size_t y, size_t begin, const GuidedPlane* before) const {
  const auto r = static_cast<ptrdiff_t>(y);
  return {values.row(r) + begin,
          values.row(r - 1) + begin,
          values.row(r - 2) + begin,
          {guide.row(r - 1) + begin, guide.row(r) + begin, guide.row(r + 1) + begin},
          before != nullptr ? before->residuals.row(r) + begin : nullptr,
          nullptr,
          flatness != nullptr ? flatness->row(r) + begin : nullptr,
          flatness != nullptr ? sets : &weights,
          constant,
          bits,
          most};
}

void GuidedPlane::fit(const Samples& samples, const GuidedPlane* before, const Plane<int16_t>* left) {
  median = false;
  if (!fit_guided(samples, values, guide, before != nullptr ? &before->residuals : nullptr, bits, weights, constant,
                  left, left_over))
    set_plain_weights();
}

void GuidedPlane::encode(const TileShape& shape, const Samples& samples, const GuidedPlane* before) {
  fit(samples, before);
  encode_fitted(shape, before, nullptr);
}

void GuidedPlane::encode_fitted(const TileShape& shape, const GuidedPlane* before, const FlatSamples* by_flatness) {
  median = has_plain_weights();
  flatness = nullptr;
  if (by_flatness != nullptr &&
      fit_flat_weights(*by_flatness, values, guide, before != nullptr ? &before->residuals : nullptr, weights, constant,
                       median, shape.total, flat_weights) &&
      add_flat_weights(weights, flat_weights, sets))
    flatness = by_flatness->flatness, median = false;
  if (median) return encode_by_median(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.span(y);
    const GuidedRows rows = rows_around(y, begin, before);
    uint8_t* const tokens = symbols.tokens.row(r) + begin;
    int16_t* const off = residuals.row(r) + begin;
    if (bits == 6)
      kernels().guided_residuals(rows, end - begin, symbols.narrow.row(r) + begin, tokens, off);
    else
      kernels().guided_residuals_wide(rows, end - begin, symbols.wide.row(r) + begin, tokens, off);
    finish_tokens(symbols, shape, y);
  }
}

void GuidedPlane::encode_by_median(const TileShape& shape) {
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const int16_t *const row = values.row(r), *const above = values.row(r - 1);
    int16_t* const out = residuals.row(r);
    uint8_t* const tokens = symbols.tokens.row(r);
    if (bits == 6) {
      kernels().median_values(above, row, shape.width, symbols.narrow.row(r), tokens, out);
    } else {
      uint32_t* const wide = symbols.wide.row(r);
      for (size_t x = 0; x < shape.width; ++x) {
        const int off = (row[x] - median_of(row[x - 1], above[x], above[x - 1])) >> bits;
        wide[x] = static_cast<uint32_t>((off * 2) ^ (off < 0 ? -1 : 0));
        out[x] = static_cast<int16_t>(off * (1 << bits));
        tokens[x] = static_cast<uint8_t>(token_of(wide[x]));
      }
    }
    finish_tokens(symbols, shape, y);
  }
}

void GuidedPlane::set_plain_weights() {
  std::fill_n(weights, kGuidedTerms, int16_t{0});
  weights[0] = weights[1] = 4096;
  constant = 0;
}

bool GuidedPlane::has_plain_weights() const {
  return weights[0] == 4096 && weights[1] == 4096 && constant == 0 &&
         std::all_of(weights + 2, weights + kGuidedTerms, [](int16_t w) { return w == 0; });
}

void GuidedPlane::put_weights(BitSink& bits) const {
  const bool plain = has_plain_weights();
  bits.put(plain, 1);
  if (plain) bits.put(median, 1);
  if (plain) return;
  for (int i = 0; i < kFarLeft; ++i) bits.put(static_cast<uint16_t>(weights[i]), 16);
  bits.put(static_cast<uint32_t>(constant + (1 << (kConstantBits - 1))), kConstantBits);
}

bool GuidedPlane::get_weights(BitReader& bits) {
  if (bits.source.take(1) != 0) {
    set_plain_weights();
    median = bits.source.take(1) != 0;
    most_weight_ = 8192;
    return !bits.overrun();
  }
  median = false;
  int total = 0;
  weights[kFarLeft] = weights[kFarAbove] = 0;
  for (int i = 0; i < kFarLeft; ++i) {
    weights[i] = static_cast<int16_t>(bits.source.take(16));
    total += std::abs(int{weights[i]});
  }
  constant = static_cast<int32_t>(bits.source.take(kConstantBits)) - (1 << (kConstantBits - 1));
  most_weight_ = total;
  return !bits.overrun() && total <= kMostWeight && std::abs(constant) <= kMostConstant;
}

namespace {

// f(difference, context) of all weights by flatness.
template <class F>
void for_each_flat_weight(FlatWeights& flat, F f) {
  GolombContext own, others;
  own.start(8), others.start(4);
  for (auto& off : flat.off)
    for (int i = 0; i < kGuidedTerms; ++i)
      if (i != kGuideHere) f(off[i], i < 4 || i > 13 ? own : others);
}

}  // namespace

void GuidedPlane::put_flat_weights(BitSink& bits) const {
  FlatWeights copy = flat_weights;
  for_each_flat_weight(copy, [&](int16_t off, GolombContext& context) { context.put(off, bits); });
}

bool GuidedPlane::get_flat_weights(BitReader& bits) {
  bool good = !median;
  for_each_flat_weight(flat_weights, [&](int16_t& off, GolombContext& context) {
    const int32_t v = bits.overrun() ? kMostFlat + 1 : context.get(bits.source);
    good &= v >= -kMostFlat && v <= kMostFlat;
    off = good ? static_cast<int16_t>(v) : int16_t{0};
  });
  if (!good || bits.overrun() || !add_flat_weights(weights, flat_weights, sets)) return false;
  for (const auto& set : sets)
    most_weight_ = std::max(most_weight_, std::accumulate(set, set + kGuidedTerms, 0,
                                                          [](int sum, int16_t w) { return sum + std::abs(int{w}); }));
  return true;
}

void GuidedPlane::decode_sums(const TileShape& shape, size_t y, const GuidedPlane* before) {
  const auto r = static_cast<ptrdiff_t>(y);
  const auto [begin, end] = shape.span(y);
  int16_t* const out = residuals.row(r) + begin;
  if (bits == 6)
    kernels().unfold_bytes(symbols.narrow.row(r) + begin, end - begin, out);
  else
    kernels().unfold_wide(symbols.wide.row(r) + begin, end - begin, bits, out);
  begin_row(shape, y);
  if (median) return;
  has_residuals = most_weight_ <= kTame;
  wild |= !has_residuals;
  GuidedRows rows = rows_around(y, begin, before);
  if (has_residuals) rows.own_residual = out, rows.constant += 1 << (bits + 12);
  kernels().guided_sums(rows, end - begin, sums.data() + begin, false);
}

// Values of pixels that are not covered, and borders, before the others are known: those of covered ones are written
// over.
void GuidedPlane::begin_row(const TileShape& shape, size_t y) {
  int16_t* const row = values.row(static_cast<ptrdiff_t>(y));
  const int16_t* const by = guide.row(static_cast<ptrdiff_t>(y));
  if (!shape.full(y)) {
    const auto [begin, end] = shape.around(y);
    kernels().fill_values(nullptr, by + begin, end - begin, bits, most, row + begin);
  }
  row[-2] = row[-1] = nearest_value(by[-1]), row[shape.width] = nearest_value(by[shape.width]);
}

void GuidedPlane::make_sums(const TileShape& shape, size_t y, const GuidedPlane* before) {
  kernels().guided_sums(rows_around(y, 0, before), shape.width, sums.data(), false);
}

void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y) {
  if (a.median || b.median || (a.flatness == nullptr) != (b.flatness == nullptr)) {
    decode_alone<true>(a, shape, y), decode_alone<true>(b, shape, y);
    return;
  }
  const bool flat = a.flatness != nullptr;
  a.wild |= b.wild;
  if (!a.wild)
    a.wild = !(flat ? run_both(FlatChain<false>(a, y), FlatChain<false>(b, y), shape, y)
                    : run_both(Chain<true, false>(a, y), Chain<true, false>(b, y), shape, y));
  if (a.wild)
    flat ? run_both(FlatChain<true>(a, y), FlatChain<true>(b, y), shape, y)
         : run_both(Chain<true, true>(a, y), Chain<true, true>(b, y), shape, y);
}

void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y) { decode_alone<false>(plane, shape, y); }

void decode_values(GuidedPlane& a, GuidedPlane& b, GuidedPlane& index, const TileShape& shape, size_t y) {
  if (is_plain(a) && is_plain(b) && is_plain(index)) {
    if (run_three(ByteChain(a, y), ByteChain(b, y), IndexChain(index, y), shape, y)) return;
    a.wild = index.wild = true;
  }
  decode_values(a, b, shape, y), decode_values(index, shape, y);
}

}  // namespace telesplat::codec::detail
