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
void PredictDepth(const uint32_t* HWY_RESTRICT above, const uint32_t* HWY_RESTRICT row, size_t width,
                  uint32_t* HWY_RESTRICT residuals) {
  const hn::CappedTag<uint32_t, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (size_t x = 0; x < width; x += hn::Lanes(d)) {
    const auto prediction =
        hn::Sub(hn::Add(hn::LoadU(d, row + x - 1), hn::LoadU(d, above + x)), hn::LoadU(d, above + x - 1));
    const auto v = hn::ShiftLeft<8>(hn::Sub(hn::LoadU(d, row + x), prediction));
    const auto sign = hn::BitCast(d, hn::ShiftRight<31>(hn::BitCast(di, v)));
    hn::StoreU(hn::ShiftRight<8>(hn::Xor(hn::ShiftLeft<1>(v), sign)), d, residuals + x);
  }
}

// The same with the median predictor on bytes; the left neighbour is `step` bytes away.
void PredictBytes(const uint8_t* HWY_RESTRICT above, const uint8_t* HWY_RESTRICT row, size_t count, size_t step,
                  uint8_t* HWY_RESTRICT residuals) {
  const hn::CappedTag<uint8_t, 64> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto left = hn::LoadU(d, row + i - step), up = hn::LoadU(d, above + i),
               up_left = hn::LoadU(d, above + i - step);
    const auto lo = hn::Min(left, up), hi = hn::Max(left, up);
    // Median of L, U, L + U - UL  =  L + U - clamp(UL to [min(L, U), max(L, U)]), exact mod 2^8.
    const auto prediction = hn::Sub(hn::Add(left, up), hn::Min(hn::Max(up_left, lo), hi));
    const auto v = hn::Sub(hn::LoadU(d, row + i), prediction);
    const auto sign = hn::BitCast(d, hn::VecFromMask(di, hn::Lt(hn::BitCast(di, v), hn::Zero(di))));
    hn::StoreU(hn::Xor(hn::Add(v, v), sign), d, residuals + i);
  }
}

// row = above + running sum of unfolded residuals: U - UL + L = U + (L - UL), the same difference as one pixel to the
// left.
bool ReconstructDepth(const uint32_t* HWY_RESTRICT above, const uint32_t* HWY_RESTRICT residuals, size_t width,
                      uint32_t* HWY_RESTRICT row) {
  size_t x = 0;
  uint32_t difference = 0;
  bool good = true;
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<uint32_t, 4> d;
  const auto one = hn::Set(d, 1u), most = hn::Set(d, image::kMaxDepthCode);
  auto before = hn::Zero(d), least = most;
  for (; x + 4 <= width; x += 4) {
    const auto z = hn::LoadU(d, residuals + x);
    auto sum = hn::Xor(hn::ShiftRight<1>(z), hn::Sub(hn::Zero(d), hn::And(z, one)));
    sum = hn::Add(sum, hn::ShiftLeftLanes<1>(d, sum));
    sum = hn::Add(sum, hn::ShiftLeftLanes<2>(d, sum));
    sum = hn::Add(sum, before);
    before = hn::Broadcast<3>(sum);
    const auto v = hn::And(hn::Add(hn::LoadU(d, above + x), sum), most);
    least = hn::Min(least, v);
    hn::StoreU(v, d, row + x);
  }
  difference = hn::GetLane(before);
  good = hn::AllTrue(d, hn::Ne(least, hn::Zero(d)));
#endif
  for (; x < width; ++x) {
    difference += unfold_depth(residuals[x]);
    row[x] = (above[x] + difference) & image::kMaxDepthCode;
    good &= row[x] != 0;
  }
  return good;
}

// The median predictor's inverse. Pixels wait for their left neighbour, five operations long; all the rest is off that
// path.
void ReconstructAttributes(const uint64_t* HWY_RESTRICT above, const uint64_t* HWY_RESTRICT residuals, size_t width,
                           uint64_t* HWY_RESTRICT row) {
#if HWY_TARGET == HWY_SCALAR
  for (size_t x = 0; x < width; ++x) {
    const uint64_t up = above[x], left = x == 0 ? up : row[x - 1], up_left = x == 0 ? up : above[x - 1];
    const auto half = [&](int shift) {
      const auto part = [&](uint64_t v) { return static_cast<uint32_t>(v >> shift); };
      return uint64_t{add_bytes(predict_bytes(part(left), part(up), part(up_left)), part(residuals[x]))} << shift;
    };
    row[x] = half(0) | half(32);
  }
#else
  const hn::FixedTag<uint8_t, 16> pair;
  const hn::RebindToSigned<decltype(pair)> signed_pair;
  const hn::Repartition<uint16_t, decltype(pair)> pair16;
  const hn::Repartition<uint64_t, decltype(pair)> pair64;
  const auto one = hn::Set(pair, uint8_t{1}), low7 = hn::Set(pair, uint8_t{0x7F});
  auto left = hn::BitCast(pair, hn::Set(pair64, above[0])), up_left = left;
  const auto step = [&](hn::VFromD<decltype(pair)> up, hn::VFromD<decltype(pair)> residual_and_up) HWY_ATTR {
    const auto lo = hn::Min(left, up), hi = hn::Max(left, up);
    left = hn::Add(residual_and_up, hn::Sub(left, hn::Min(hn::Max(up_left, lo), hi)));
    up_left = up;
  };
  size_t x = 0;
  for (; x + 2 <= width; x += 2) {
    const auto z = hn::BitCast(pair, hn::LoadU(pair64, residuals + x)),
               up = hn::BitCast(pair, hn::LoadU(pair64, above + x));
    const auto half = hn::And(hn::BitCast(pair, hn::ShiftRight<1>(hn::BitCast(pair16, z))), low7);
    const auto sign = hn::BitCast(pair, hn::Neg(hn::BitCast(signed_pair, hn::And(z, one))));
    const auto known = hn::Add(hn::Xor(half, sign), up);
    step(up, known);  // only the lower half counts
    const auto first = left;
    step(hn::BitCast(pair, hn::ShiftRightBytes<8>(pair64, hn::BitCast(pair64, up))),
         hn::BitCast(pair, hn::ShiftRightBytes<8>(pair64, hn::BitCast(pair64, known))));
    hn::StoreU(hn::InterleaveLower(pair64, hn::BitCast(pair64, first), hn::BitCast(pair64, left)), pair64, row + x);
  }
  if (x < width) {
    const auto up = hn::BitCast(pair, hn::Set(pair64, above[x]));
    step(up, hn::Add(hn::BitCast(pair, hn::Set(pair64, unfold_bytes(residuals[x]))), up));
    row[x] = hn::GetLane(hn::BitCast(pair64, left));
  }
#endif
}

void SplitAttributes(const uint64_t* HWY_RESTRICT row, size_t width, uint32_t* HWY_RESTRICT colour,
                     uint16_t* HWY_RESTRICT normal) {
  size_t x = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<uint32_t, 4> d;
  const hn::FixedTag<uint16_t, 4> d16;
  for (; x + 4 <= width; x += 4) {
    const auto a = hn::LoadU(d, reinterpret_cast<const uint32_t*>(row + x)),
               b = hn::LoadU(d, reinterpret_cast<const uint32_t*>(row + x + 2));
    hn::StoreU(hn::ConcatEven(d, b, a), d, colour + x);
    hn::StoreU(hn::TruncateTo(d16, hn::ConcatOdd(d, b, a)), d16, normal + x);
  }
#endif
  for (; x < width; ++x) colour[x] = colour_of(row[x]), normal[x] = normal_of(row[x]);
}

}  // namespace telesplat::codec::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::codec::detail {

HWY_EXPORT(PredictDepth);
HWY_EXPORT(PredictBytes);
HWY_EXPORT(ReconstructDepth);
HWY_EXPORT(ReconstructAttributes);
HWY_EXPORT(SplitAttributes);

namespace {

// Left of the first pixel both neighbours are taken to be the pixel above it, which so becomes its prediction.
void set_edge(FilledRow& above, FilledRow& row) {
  above.depth()[-1] = row.depth()[-1] = above.depth()[0];
  above.colour()[-1] = row.colour()[-1] = above.colour()[0];
  above.normal()[-1] = row.normal()[-1] = above.normal()[0];
}

}  // namespace

uint32_t predict_depth(uint32_t left, uint32_t up, uint32_t up_left) {
  return (left + up - up_left) & image::kMaxDepthCode;
}

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
  predict(bytes(above.colour()), bytes(row.colour()), width * 4, 4,
          reinterpret_cast<uint8_t*>(residuals.colour.data()));
  predict(bytes(above.normal()), bytes(row.normal()), width * 2, 2,
          reinterpret_cast<uint8_t*>(residuals.normal.data()));
}

bool reconstruct_depth(const uint32_t* above, const uint32_t* residuals, size_t width, uint32_t* row) {
  return HWY_DYNAMIC_DISPATCH(ReconstructDepth)(above, residuals, width, row);
}
void reconstruct_attributes(const uint64_t* above, const uint64_t* residuals, size_t width, uint64_t* row) {
  HWY_DYNAMIC_DISPATCH(ReconstructAttributes)(above, residuals, width, row);
}
void split_attributes(const uint64_t* row, size_t width, uint32_t* colour, uint16_t* normal) {
  HWY_DYNAMIC_DISPATCH(SplitAttributes)(row, width, colour, normal);
}

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
