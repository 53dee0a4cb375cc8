#include "common/codec/dense/guided.h"

#include <algorithm>
#include <cstdlib>

namespace telesplat::codec::detail {
namespace {

constexpr int kConstantBits = 28;

int median_of(int left, int up, int corner) {
  return left + up - std::clamp(corner, std::min(left, up), std::max(left, up));
}

// Values of one plane, each from the one to its left: the longest chain of a decoder. So what is nearly never needed,
// the bounds of predictions and values, stands beside it, where a processor guesses that it is not. Bytes are 64ths and
// mod 256.
template <bool kByte>
struct Chain {
  Chain(GuidedPlane& guided, size_t y)
      : plane(guided),
        value(guided.values.row(static_cast<ptrdiff_t>(y))),
        residual(plane.residuals.row(static_cast<ptrdiff_t>(y))),
        guide(plane.guide.row(static_cast<ptrdiff_t>(y))),
        sums(plane.sums.data()),
        weight(plane.weights[0] * (1 << plane.bits)),
        bits(kByte ? 6 : plane.bits),
        most(plane.most),
        left(value[-1] >> plane.bits) {}
  void step(size_t x) {
    const int64_t sum = sums[x] + (int64_t{1} << (bits + 12)) + weight * left;
    const int64_t off = int64_t{residual[x]} * (1 << 13);
    const int64_t next = (sum + off) >> (bits + 13);
    const bool plain = static_cast<uint64_t>(sum) < static_cast<uint64_t>(most + 1) << (bits + 13) &&
                       static_cast<uint64_t>(next) <= static_cast<uint64_t>(kByte ? 255 : most);
    left = next;
    if (!plain) [[unlikely]]
      left = bounded(sum, residual[x]);
    value[x] = static_cast<int16_t>(left << bits);
  }
  void hole(size_t x) { value[x] = plane.nearest_value(guide[x]), left = value[x] >> plane.bits; }
  int64_t bounded(int64_t sum, int16_t off) const {
    const int64_t next = std::clamp<int64_t>(sum >> (bits + 13), 0, most) + (off >> bits);
    return kByte ? next & 255 : std::clamp<int64_t>(next, 0, most);
  }

  const GuidedPlane& plane;
  int16_t* const value;
  const int16_t *const residual, *const guide;
  const int32_t* const sums;
  const int64_t weight;
  const int bits, most;
  int64_t left;
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
        guide(guided.guide.row(static_cast<ptrdiff_t>(y))),
        left(value[-1]) {}
  void step(size_t x) {
    const int next = median_of(left, above[x], above[x - 1]) + residual[x];
    left = kByte ? next & 255 * 64 : std::clamp(next, 0, plane.most << plane.bits);
    value[x] = static_cast<int16_t>(left);
  }
  void hole(size_t x) {
    value[x] = plane.nearest_value(guide[x]);
    left = value[x];
  }

  const GuidedPlane& plane;
  int16_t* const value;
  const int16_t *const above, *const residual, *const guide;
  int left;
};

template <class Chain>
void run(Chain chain, const TileShape& shape, size_t y) {
  for (size_t x = 0; x < shape.width; ++x) shape.at(x, y) ? chain.step(x) : chain.hole(x);
}

template <bool kByte>
void decode_alone(GuidedPlane& plane, const TileShape& shape, size_t y) {
  if (plane.median)
    run(MedianChain<kByte>(plane, y), shape, y);
  else
    run(Chain<kByte>(plane, y), shape, y);
  plane.finish_row(shape, y);
}

}  // namespace

int16_t GuidedPlane::nearest_value(int16_t by) const {
  return static_cast<int16_t>(std::clamp((by + (1 << bits >> 1)) >> bits, 0, most) << bits);
}

void GuidedPlane::reset(const TileShape& shape, int fraction, int largest) {
  bits = fraction, most = largest;
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
}

void GuidedPlane::finish_row(const TileShape& shape, size_t y) {
  int16_t* const row = values.row(static_cast<ptrdiff_t>(y));
  const int16_t* const by = guide.row(static_cast<ptrdiff_t>(y));
  shape.for_each_hole(y, [&](size_t x) { row[x] = nearest_value(by[x]); });
  row[-1] = nearest_value(by[-1]), row[shape.width] = nearest_value(by[shape.width]);
}

GuidedRows GuidedPlane::rows_around(size_t y, const GuidedPlane* before) const {
  const auto r = static_cast<ptrdiff_t>(y);
  GuidedRows rows{values.row(r),
                  values.row(r - 1),
                  {guide.row(r - 1), guide.row(r), guide.row(r + 1)},
                  before != nullptr ? before->residuals.row(r) : nullptr,
                  {},
                  constant,
                  bits,
                  most};
  std::copy_n(weights, kGuidedTerms, rows.weights);
  return rows;
}

void GuidedPlane::fit(const Samples& samples, const GuidedPlane* before, const Plane<int16_t>* left) {
  median = false;
  if (!fit_guided(samples, values, guide, before != nullptr ? &before->residuals : nullptr, bits, weights, constant,
                  left))
    set_plain_weights();
}

void GuidedPlane::encode(const TileShape& shape, const Samples& samples, const GuidedPlane* before) {
  fit(samples, before);
  median = has_plain_weights();
  if (median) return encode_by_median(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    if (bits == 6)
      kernels().guided_residuals(rows_around(y, before), shape.width, symbols.narrow.row(r), symbols.tokens.row(r),
                                 residuals.row(r));
    else
      kernels().guided_residuals_wide(rows_around(y, before), shape.width, symbols.wide.row(r), symbols.tokens.row(r),
                                      residuals.row(r));
    shape.for_each_hole(y, [&](size_t x) { residuals.row(r)[x] = 0; });
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
    shape.for_each_hole(y, [&](size_t x) { out[x] = 0; });
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
  for (const int16_t w : weights) bits.put(static_cast<uint16_t>(w), 16);
  bits.put(static_cast<uint32_t>(constant + (1 << (kConstantBits - 1))), kConstantBits);
}

bool GuidedPlane::get_weights(BitReader& bits) {
  if (bits.source.take(1) != 0) {
    set_plain_weights();
    median = bits.source.take(1) != 0;
    return !bits.overrun();
  }
  median = false;
  int total = 0;
  for (int16_t& w : weights) {
    w = static_cast<int16_t>(bits.source.take(16));
    total += std::abs(int{w});
  }
  constant = static_cast<int32_t>(bits.source.take(kConstantBits)) - (1 << (kConstantBits - 1));
  return !bits.overrun() && total <= kMostWeight && std::abs(constant) <= kMostConstant;
}

void GuidedPlane::decode_sums(const TileShape& shape, size_t y, const GuidedPlane* before) {
  const auto r = static_cast<ptrdiff_t>(y);
  int16_t* const out = residuals.row(r);
  const auto unfold = [&](const auto* z) {
    for (size_t x = 0; x < shape.width; ++x)
      out[x] = static_cast<int16_t>((static_cast<int>(z[x] >> 1) ^ -static_cast<int>(z[x] & 1)) * (1 << bits));
  };
  if (bits == 6)
    unfold(symbols.narrow.row(r));
  else
    unfold(symbols.wide.row(r));
  values.row(r)[-1] = nearest_value(guide.row(r)[-1]);
  if (!median) make_sums(shape, y, before);
}

void GuidedPlane::make_sums(const TileShape& shape, size_t y, const GuidedPlane* before) {
  kernels().guided_sums(rows_around(y, before), shape.width, sums.data());
}

void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y) {
  if (a.median || b.median) {
    decode_alone<true>(a, shape, y), decode_alone<true>(b, shape, y);
    return;
  }
  Chain<true> first(a, y), second(b, y);
  if (shape.full(y)) {
    for (size_t x = 0; x < shape.width; ++x) first.step(x), second.step(x);
  } else {
    for (size_t x = 0; x < shape.width; ++x)
      shape.at(x, y) ? (first.step(x), second.step(x)) : (first.hole(x), second.hole(x));
  }
  a.finish_row(shape, y), b.finish_row(shape, y);
}

void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y) { decode_alone<false>(plane, shape, y); }

}  // namespace telesplat::codec::detail
