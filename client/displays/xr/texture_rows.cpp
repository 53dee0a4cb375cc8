#include "client/displays/xr/texture_rows.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "client/displays/xr/texture_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::viewer::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Whole vectors; returns how many pixels are done.
size_t ToRgba(const uint32_t* HWY_RESTRICT colour, size_t pixels, uint32_t* HWY_RESTRICT out) {
  const hn::ScalableTag<uint32_t> d;
  const auto others = hn::Set(d, 0xff00ff00u), low = hn::Set(d, 0xffu);
  size_t x = 0;
  for (; x + hn::Lanes(d) <= pixels; x += hn::Lanes(d)) {
    const auto c = hn::LoadU(d, colour + x);
    const auto red = hn::And(hn::ShiftRight<16>(c), low), blue = hn::ShiftLeft<16>(hn::And(c, low));
    hn::StoreU(hn::Or(hn::And(c, others), hn::Or(red, blue)), d, out + x);
  }
  return x;
}

template <class D>
HWY_INLINE void Put(D d, hn::Vec<D> value, float* HWY_RESTRICT out) {
  hn::StoreU(value, d, out);
}

template <class D>
HWY_INLINE void Put(D d, hn::Vec<D> value, uint16_t* HWY_RESTRICT out) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<uint16_t, D> d16;
  const auto whole = hn::ConvertTo(di, hn::MulAdd(value, hn::Set(d, 65535.0f), hn::Set(d, 0.5f)));
  hn::StoreU(hn::DemoteTo(d16, whole), d16, out);
}

template <class T>
size_t HalfDepth(const float* HWY_RESTRICT above, const float* HWY_RESTRICT below, float near, float scale,
                 size_t pixels, T* HWY_RESTRICT out) {
  const hn::ScalableTag<float> d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  size_t x = 0;
  for (; x + hn::Lanes(d) <= pixels; x += hn::Lanes(d)) {
    hn::Vec<decltype(d)> a, b, e, f;
    hn::LoadInterleaved2(d, above + 2 * x, a, b);
    hn::LoadInterleaved2(d, below + 2 * x, e, f);
    const auto nearest = hn::Min(hn::Min(a, b), hn::Min(e, f));
    const auto value = hn::Mul(hn::Sub(hn::Set(d, near), hn::Div(one, nearest)), hn::Set(d, scale));
    Put(d, hn::Min(hn::Max(value, zero), one), out + x);
  }
  return x;
}

size_t ToHalfDepth(const float* above, const float* below, float near, float scale, size_t pixels, float* out) {
  return HalfDepth(above, below, near, scale, pixels, out);
}

size_t ToHalfDepth16(const float* above, const float* below, float near, float scale, size_t pixels, uint16_t* out) {
  return HalfDepth(above, below, near, scale, pixels, out);
}

}  // namespace telesplat::viewer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::viewer {

HWY_EXPORT(ToRgba);
HWY_EXPORT(ToHalfDepth);
HWY_EXPORT(ToHalfDepth16);

namespace {

struct Scale {
  float near, scale;
  explicit Scale(const DepthRange& range)
      : near(float(1 / range.near_m)), scale(float(1 / (1 / range.near_m - 1 / range.far_m))) {}
  float of_four(const float* above, const float* below) const {
    const float nearest = std::min({above[0], above[1], below[0], below[1]});
    return std::clamp((near - 1 / nearest) * scale, 0.0f, 1.0f);
  }
};

}  // namespace

void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out) {
  for (size_t x = HWY_DYNAMIC_DISPATCH(ToRgba)(colour, pixels, out); x < pixels; ++x)
    out[x] = (colour[x] & 0xff00ff00u) | (colour[x] >> 16 & 0xffu) | (colour[x] & 0xffu) << 16;
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out) {
  const Scale s(range);
  for (size_t x = HWY_DYNAMIC_DISPATCH(ToHalfDepth)(above, below, s.near, s.scale, pixels, out); x < pixels; ++x)
    out[x] = s.of_four(above + 2 * x, below + 2 * x);
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out) {
  const Scale s(range);
  for (size_t x = HWY_DYNAMIC_DISPATCH(ToHalfDepth16)(above, below, s.near, s.scale, pixels, out); x < pixels; ++x)
    out[x] = uint16_t(s.of_four(above + 2 * x, below + 2 * x) * 65535.0f + 0.5f);
}

}  // namespace telesplat::viewer
#endif
