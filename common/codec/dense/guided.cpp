#include "common/codec/dense/guided.h"

#include <algorithm>
#include <cstdlib>

namespace telesplat::codec::detail {
namespace {

constexpr int kConstantBits = 28;

int16_t nearest_value(int16_t guide) { return static_cast<int16_t>(std::clamp((guide + 32) & ~63, 0, 254 * 64)); }

// Values of one plane, each from the one to its left.
struct Chain {
  explicit Chain(GuidedPlane& plane, size_t y)
      : value(plane.values.row(static_cast<ptrdiff_t>(y))),
        residual(plane.residuals.row(static_cast<ptrdiff_t>(y))),
        guide(plane.guide.row(static_cast<ptrdiff_t>(y))),
        sums(plane.sums.data()),
        weight(plane.weights[0] * 64),
        left(value[-1] >> 6) {}
  void step(size_t x) {
    const int32_t p = (sums[x] + weight * left + (1 << 18)) >> 19;
    left = (std::clamp(p, 0, 254) + (residual[x] >> 6)) & 255;
    value[x] = static_cast<int16_t>(left * 64);
  }
  void hole(size_t x) { value[x] = nearest_value(guide[x]), left = value[x] >> 6; }

  int16_t *const value;
  const int16_t *const residual, *const guide;
  const int32_t *const sums, weight;
  int32_t left;
};

}  // namespace

void GuidedPlane::reset(const TileShape& shape) {
  for (Plane<int16_t>* plane : {&values, &guide, &residuals}) plane->reset(shape.width, shape.height);
  symbols.reset(shape, false);
  sums.resize(std::max(sums.size(), shape.width + 64));
}

void GuidedPlane::begin(const TileShape& shape) {
  const size_t w = shape.width;
  const auto h = static_cast<ptrdiff_t>(shape.height);
  for (ptrdiff_t y = 0; y < h; ++y) guide.row(y)[-1] = guide.row(y)[0], guide.row(y)[w] = guide.row(y)[w - 1];
  std::copy_n(guide.row(0) - 1, w + 2, guide.row(-1) - 1);
  std::copy_n(guide.row(h - 1) - 1, w + 2, guide.row(h) - 1);
  std::transform(guide.row(0) - 1, guide.row(0) + w + 1, values.row(-1) - 1, nearest_value);
}

void GuidedPlane::finish_row(const TileShape& shape, size_t y) {
  int16_t* const row = values.row(static_cast<ptrdiff_t>(y));
  const int16_t* const by = guide.row(static_cast<ptrdiff_t>(y));
  shape.for_each_hole(y, [&](size_t x) { row[x] = nearest_value(by[x]); });
  row[-1] = nearest_value(by[-1]), row[shape.width] = nearest_value(by[shape.width]);
}

GuidedRows GuidedPlane::rows_around(size_t y, const GuidedPlane* before) const {
  const auto r = static_cast<ptrdiff_t>(y);
  GuidedRows rows{values.row(r),  values.row(r - 1), {guide.row(r - 1), guide.row(r), guide.row(r + 1)},
                  before != nullptr ? before->residuals.row(r) : nullptr, {}, constant};
  std::copy_n(weights, kGuidedTerms, rows.weights);
  return rows;
}

void GuidedPlane::encode(const TileShape& shape, const Samples& samples, const GuidedPlane* before) {
  fit_guided(samples, values, guide, before != nullptr ? &before->residuals : nullptr, weights, constant);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    kernels().guided_residuals(rows_around(y, before), shape.width, symbols.narrow.row(r), symbols.tokens.row(r),
                               residuals.row(r));
    shape.for_each_hole(y, [&](size_t x) { residuals.row(r)[x] = 0; });
    finish_tokens(symbols, shape, y);
  }
}

void GuidedPlane::put_weights(BitSink& bits) const {
  for (const int16_t w : weights) bits.put(static_cast<uint16_t>(w), 16);
  bits.put(static_cast<uint32_t>(constant + (1 << (kConstantBits - 1))), kConstantBits);
}

bool GuidedPlane::get_weights(BitReader& bits) {
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
  const uint8_t* const z = symbols.narrow.row(r);
  int16_t* const out = residuals.row(r);
  for (size_t x = 0; x < shape.width; ++x)
    out[x] = static_cast<int16_t>(((z[x] >> 1) ^ -(z[x] & 1)) * 64);
  values.row(r)[-1] = nearest_value(guide.row(r)[-1]);
  kernels().guided_sums(rows_around(y, before), shape.width, sums.data());
}

void decode_values(GuidedPlane& a, GuidedPlane& b, const TileShape& shape, size_t y) {
  Chain first(a, y), second(b, y);
  if (shape.full(y)) {
    for (size_t x = 0; x < shape.width; ++x) first.step(x), second.step(x);
  } else {
    for (size_t x = 0; x < shape.width; ++x)
      shape.at(x, y) ? (first.step(x), second.step(x)) : (first.hole(x), second.hole(x));
  }
  a.finish_row(shape, y), b.finish_row(shape, y);
}

void decode_values(GuidedPlane& plane, const TileShape& shape, size_t y) {
  Chain chain(plane, y);
  for (size_t x = 0; x < shape.width; ++x) shape.at(x, y) ? chain.step(x) : chain.hole(x);
  plane.finish_row(shape, y);
}

}  // namespace telesplat::codec::detail
