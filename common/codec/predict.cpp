#include "common/codec/predict.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/codec/predict.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::codec::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// residuals = fold(row - (L + U - UL)); writes up to the end of the last vector.
void PredictDepth(const uint32_t* HWY_RESTRICT above, const uint32_t* HWY_RESTRICT row, size_t width, uint32_t* HWY_RESTRICT residuals) {
  const hn::CappedTag<uint32_t, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (size_t x = 0; x < width; x += hn::Lanes(d)) {
    const auto prediction = hn::Sub(hn::Add(hn::LoadU(d, row + x - 1), hn::LoadU(d, above + x)), hn::LoadU(d, above + x - 1));
    const auto v = hn::ShiftLeft<8>(hn::Sub(hn::LoadU(d, row + x), prediction));
    const auto sign = hn::BitCast(d, hn::ShiftRight<31>(hn::BitCast(di, v)));
    hn::StoreU(hn::ShiftRight<8>(hn::Xor(hn::ShiftLeft<1>(v), sign)), d, residuals + x);
  }
}

// The same with the median predictor on bytes; the left neighbour is `step` bytes away.
void PredictBytes(const uint8_t* HWY_RESTRICT above, const uint8_t* HWY_RESTRICT row, size_t count, size_t step, uint8_t* HWY_RESTRICT residuals) {
  const hn::CappedTag<uint8_t, 64> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto left = hn::LoadU(d, row + i - step), up = hn::LoadU(d, above + i), up_left = hn::LoadU(d, above + i - step);
    const auto lo = hn::Min(left, up), hi = hn::Max(left, up);
    // Median of L, U, L + U - UL  =  L + U - clamp(UL to [min(L, U), max(L, U)]), exact mod 2^8.
    const auto prediction = hn::Sub(hn::Add(left, up), hn::Min(hn::Max(up_left, lo), hi));
    const auto v = hn::Sub(hn::LoadU(d, row + i), prediction);
    const auto sign = hn::BitCast(d, hn::VecFromMask(di, hn::Lt(hn::BitCast(di, v), hn::Zero(di))));
    hn::StoreU(hn::Xor(hn::Add(v, v), sign), d, residuals + i);
  }
}

// row = above + running sum of unfolded residuals: U - UL + L = U + (L - UL), the same difference as one pixel to the left.
void ReconstructDepth(const uint32_t* HWY_RESTRICT above, const uint32_t* HWY_RESTRICT residuals, size_t width, uint32_t* HWY_RESTRICT row) {
#if HWY_TARGET == HWY_SCALAR
  uint32_t difference = 0;
  for (size_t x = 0; x < width; ++x) {
    difference += unfold_depth(residuals[x]);
    row[x] = (above[x] + difference) & image::kMaxDepthCode;
  }
#else
  const hn::FixedTag<uint32_t, 4> d;
  const auto one = hn::Set(d, 1u), most = hn::Set(d, image::kMaxDepthCode);
  auto before = hn::Zero(d);
  for (size_t x = 0; x < width; x += 4) {
    const auto z = hn::LoadU(d, residuals + x);
    auto sum = hn::Xor(hn::ShiftRight<1>(z), hn::Sub(hn::Zero(d), hn::And(z, one)));
    sum = hn::Add(sum, hn::ShiftLeftLanes<1>(d, sum));
    sum = hn::Add(sum, hn::ShiftLeftLanes<2>(d, sum));
    sum = hn::Add(sum, before);
    before = hn::Broadcast<3>(sum);
    hn::StoreU(hn::And(hn::Add(hn::LoadU(d, above + x), sum), most), d, row + x);
  }
#endif
}

// colour and normal [0, width) from their residuals; index -1 is set. A pixel waits for its left neighbour, five operations
// long, so all its bytes go through at once: colour in bytes 0-3, normal in bytes 4-5.
void ReconstructBytes(const uint32_t* HWY_RESTRICT above_colour, const uint16_t* HWY_RESTRICT above_normal,
                      const uint32_t* HWY_RESTRICT colour_residuals, const uint16_t* HWY_RESTRICT normal_residuals, size_t width,
                      uint32_t* HWY_RESTRICT colour, uint16_t* HWY_RESTRICT normal) {
#if HWY_TARGET == HWY_SCALAR
  for (size_t x = 0; x < width; ++x) {
    colour[x] = add_bytes(predict_bytes(colour[x - 1], above_colour[x], above_colour[x - 1]), colour_residuals[x]);
    normal[x] = static_cast<uint16_t>(add_bytes(predict_bytes(normal[x - 1], above_normal[x], above_normal[x - 1]), normal_residuals[x]));
  }
#else
  const hn::FixedTag<uint8_t, 8> d;
  const hn::FixedTag<uint64_t, 1> word;
  const auto join = [](uint32_t c, uint16_t n) { return c | uint64_t{n} << 32; };
  const auto vector = [&](uint64_t v) { return hn::BitCast(d, hn::Set(word, v)); };
  auto left = vector(join(colour[-1], normal[-1])), up_left = left;
  for (size_t x = 0; x < width; ++x) {
    const auto residual = vector(unfold_bytes(join(colour_residuals[x], normal_residuals[x])));
    const auto up = vector(join(above_colour[x], above_normal[x]));
    const auto lo = hn::Min(left, up), hi = hn::Max(left, up);
    const auto known = hn::Add(residual, up);  // off the critical path
    left = hn::Add(known, hn::Sub(left, hn::Min(hn::Max(up_left, lo), hi)));
    up_left = up;
    const uint64_t value = hn::GetLane(hn::BitCast(word, left));
    colour[x] = static_cast<uint32_t>(value);
    normal[x] = static_cast<uint16_t>(value >> 32);
  }
#endif
}

}  // namespace telesplat::codec::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::codec::detail {

HWY_EXPORT(PredictDepth);
HWY_EXPORT(PredictBytes);
HWY_EXPORT(ReconstructDepth);
HWY_EXPORT(ReconstructBytes);

namespace {

// Left of the first pixel both neighbours are taken to be the pixel above it, which so becomes its prediction.
void set_edge(FilledRow& above, FilledRow& row) {
  above.depth()[-1] = row.depth()[-1] = above.depth()[0];
  above.colour()[-1] = row.colour()[-1] = above.colour()[0];
  above.normal()[-1] = row.normal()[-1] = above.normal()[0];
}

}  // namespace

uint32_t predict_depth(uint32_t left, uint32_t up, uint32_t up_left) { return (left + up - up_left) & image::kMaxDepthCode; }

uint32_t predict_bytes(uint32_t left, uint32_t up, uint32_t up_left) {
  uint32_t prediction = 0;
  for (int shift = 0; shift < 32; shift += 8) {
    const uint32_t l = left >> shift & 255, u = up >> shift & 255, c = up_left >> shift & 255;
    const uint32_t clamped = std::min(std::max(c, std::min(l, u)), std::max(l, u));
    prediction |= (l + u - clamped) << shift;  // within [min(l, u), max(l, u)]
  }
  return prediction;
}

void predict_row(FilledRow& above, FilledRow& row, size_t width, Residuals& residuals) {
  set_edge(above, row);
  const auto bytes = [](const auto* p) { return reinterpret_cast<const uint8_t*>(p); };
  HWY_DYNAMIC_DISPATCH(PredictDepth)(above.depth(), row.depth(), width, residuals.depth.data());
  const auto predict = HWY_DYNAMIC_DISPATCH(PredictBytes);
  predict(bytes(above.colour()), bytes(row.colour()), width * 4, 4, reinterpret_cast<uint8_t*>(residuals.colour.data()));
  predict(bytes(above.normal()), bytes(row.normal()), width * 2, 2, reinterpret_cast<uint8_t*>(residuals.normal.data()));
}

void reconstruct_row(FilledRow& above, FilledRow& row, size_t width, const Residuals& residuals) {
  set_edge(above, row);
  HWY_DYNAMIC_DISPATCH(ReconstructDepth)(above.depth(), residuals.depth.data(), width, row.depth());
  HWY_DYNAMIC_DISPATCH(ReconstructBytes)
  (above.colour(), above.normal(), residuals.colour.data(), residuals.normal.data(), width, row.colour(), row.normal());
}

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
