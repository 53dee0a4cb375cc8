#include "common/codec/dense/guided.h"

#include <algorithm>
#include <cstdlib>

namespace telesplat::codec::detail {
namespace {

constexpr int kConstantBits = 28;

// Decodes values of one plane, each from the one to its left: the longest chain of dependencies in a decoder.
template <bool kMedian, bool kWraps>
struct Chain {
  Chain(GuidedPlane& plane, size_t y)
      : value(plane.values.row(static_cast<ptrdiff_t>(y))),
        above(plane.values.row(static_cast<ptrdiff_t>(y) - 1)),
        residual(plane.residuals.row(static_cast<ptrdiff_t>(y))),
        sums(plane.sums.data()),
        weight(plane.weights[0]),
        bits(plane.bits),
        most(plane.most) {}
  void begin(size_t x) { left = value[static_cast<ptrdiff_t>(x) - 1]; }
  void step(size_t x) {
    const int guess = kMedian ? median_of(left, above[x], above[static_cast<ptrdiff_t>(x) - 1])
                              : std::clamp((sums[x] + weight * left) >> (bits + 13), 0, most) << bits;
    const int next = guess + residual[x];
    left = kWraps ? next & 255 << bits : std::clamp(next, 0, most << bits);
    value[x] = static_cast<int16_t>(left);
  }

  int16_t* const value;
  const int16_t *const above, *const residual;
  const int32_t* const sums;
  const int32_t weight;
  const int bits, most;
  int left = 0;
};

template <class... Chains>
void run(const TileShape& shape, size_t y, Chains... chains) {
  shape.for_each_run(y, [&](size_t x, size_t end) {
    for ((chains.begin(x), ...); x < end; ++x) (chains.step(x), ...);
  });
}

}  // namespace

int16_t GuidedPlane::nearest_value(int16_t by) const {
  return static_cast<int16_t>(std::clamp((by + (1 << bits >> 1)) >> bits, 0, most) << bits);
}

void GuidedPlane::reset(const TileShape& shape, int fraction, int largest) {
  bits = fraction, most = largest;
  for (Plane<int16_t>* plane : {&values, &guide, &residuals}) plane->reset(shape.width, shape.height);
  symbols.reset(shape, bits == kByteBits);
  sums.resize(std::max(sums.size(), shape.width));
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
  if (!shape.full(y))
    shape.for_each_gap(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) row[x] = nearest_value(by[x]);
    });
  row[-1] = nearest_value(by[-1]), row[shape.width] = nearest_value(by[shape.width]);
}

GuidedRows GuidedPlane::rows_around(size_t y, const GuidedPlane* before) const {
  const auto r = static_cast<ptrdiff_t>(y);
  return {.own = values.row(r),
          .above = values.row(r - 1),
          .guide = {guide.row(r - 1), guide.row(r), guide.row(r + 1)},
          .residual = before != nullptr ? before->residuals.row(r) : nullptr,
          .weights = weights,
          .constant = constant,
          .bits = bits,
          .most = most,
          .wraps = bits == kByteBits};
}

double GuidedPlane::fit(const Samples& samples, const GuidedPlane* before) {
  const GuidedFit fitted = fit_guided({.samples = samples,
                                       .values = values,
                                       .guide = guide,
                                       .residuals = before != nullptr ? &before->residuals : nullptr,
                                       .bits = bits});
  median = !fitted.better_than_median;
  std::copy_n(fitted.weights, kGuidedTerms, weights);
  constant = fitted.constant;
  return fitted.left_over;
}

void GuidedPlane::encode(const TileShape& shape, const GuidedPlane* before) {
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const GuidedRows rows = rows_around(y, before);
    uint32_t* const z = symbols.z.row(r);
    if (median)
      median_residuals(rows, shape.width, z);
    else
      guided_sums(rows, shape.width, sums.data()), guided_residuals(rows, sums.data(), shape.width, z);
    tokens_of(z, shape.width, symbols.tokens.row(r));
    unfold_row(z, shape.width, bits, residuals.row(r));
    finish_tokens(symbols, shape, y);
  }
}

void GuidedPlane::put_weights(BitSink& out) const {
  out.put(median, 1);
  if (median) return;
  for (const int16_t w : weights) out.put(static_cast<uint16_t>(w), 16);
  out.put(static_cast<uint32_t>(constant + (1 << (kConstantBits - 1))), kConstantBits);
}

bool GuidedPlane::get_weights(BitReader& in) {
  median = in.source.take(1) != 0;
  if (median) return !in.overrun();
  int total = 0;
  for (int16_t& w : weights) {
    w = static_cast<int16_t>(in.source.take(16));
    total += std::abs(int{w});
  }
  constant = static_cast<int32_t>(in.source.take(kConstantBits)) - (1 << (kConstantBits - 1));
  return !in.overrun() && total <= kMostWeight && std::abs(constant) <= kMostConstant;
}

void GuidedPlane::decode_sums(const TileShape& shape, size_t y, const GuidedPlane* before) {
  const auto r = static_cast<ptrdiff_t>(y);
  unfold_row(symbols.z.row(r), shape.width, bits, residuals.row(r));
  finish_row(shape, y);
  if (!median) guided_sums(rows_around(y, before), shape.width, sums.data());
}

void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y) {
  if (plane.bits != GuidedPlane::kByteBits)
    plane.median ? run(shape, y, Chain<true, false>(plane, y)) : run(shape, y, Chain<false, false>(plane, y));
  else
    plane.median ? run(shape, y, Chain<true, true>(plane, y)) : run(shape, y, Chain<false, true>(plane, y));
}

void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y) {
  if (!a.median && !b.median && a.bits == GuidedPlane::kByteBits && b.bits == a.bits)
    return run(shape, y, Chain<false, true>(a, y), Chain<false, true>(b, y));
  decode_values(a, shape, y), decode_values(b, shape, y);
}

}  // namespace telesplat::codec::detail
