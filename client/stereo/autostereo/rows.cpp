#include "client/stereo/autostereo/rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "client/stereo/autostereo/rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::stereo::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Distance from the middle of the nearest line, for lines that are half a line too large.
template <class D, class V>
HWY_INLINE V Off(D d, V line) {
  const hn::RebindToSigned<D> di;
  const auto whole = hn::ConvertTo(d, hn::ConvertTo(di, line));
  return hn::Abs(hn::Sub(hn::Sub(line, whole), hn::Set(d, 0.5f)));
}

void SharePixels(const Sharing& s, int pixels, uint32_t* HWY_RESTRICT left, uint32_t* HWY_RESTRICT right) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  const int lanes = int(hn::Lanes(d));
  const auto guard = hn::Set(d, s.guard);
  for (int x = 0; x < pixels; x += lanes) {
    auto of_left = hn::Zero(du), of_right = hn::Zero(du);
    for (int part = 0; part < s.parts; ++part) {
      const auto n = hn::Add(hn::Iota(d, float(x)), hn::Set(d, float(part) / float(s.parts)));
      const auto line_l = hn::MulAdd(hn::Set(d, s.eyes[0].step), n, hn::Set(d, s.eyes[0].first));
      const auto line_r = hn::MulAdd(hn::Set(d, s.eyes[1].step), n, hn::Set(d, s.eyes[1].first));
      const auto nearer_right = hn::Sub(Off(d, line_l), Off(d, line_r));
      const auto shown = hn::Ge(hn::Abs(nearer_right), guard);
      const auto is_right = hn::Gt(nearer_right, hn::Zero(d));
      const auto bits = hn::BitCast(d, hn::Set(du, s.bits[size_t(part)]));
      const auto given = hn::IfThenElseZero(shown, bits);
      of_right = hn::Or(of_right, hn::BitCast(du, hn::IfThenElseZero(is_right, given)));
      of_left = hn::Or(of_left, hn::BitCast(du, hn::IfThenZeroElse(is_right, given)));
    }
    hn::StoreU(of_left, du, left + x);
    hn::StoreU(of_right, du, right + x);
  }
}

// Computes a * 256 + (b - a) * weight for two channels at a time, 16 bits apart. The sum is taken modulo 2^32.
template <class V, class W>
HWY_INLINE V Between(V a, V b, W weight) {
  const hn::DFromV<V> d;
  const auto red_blue = hn::Set(d, 0xff00ffu), green = hn::Set(d, 0xffu);
  const auto rb_a = hn::And(a, red_blue), rb_b = hn::And(b, red_blue);
  const auto g_a = hn::And(hn::ShiftRight<8>(a), green), g_b = hn::And(hn::ShiftRight<8>(b), green);
  const auto rb = hn::Add(hn::Add(hn::ShiftLeft<8>(rb_a), hn::Mul(hn::Sub(rb_b, rb_a), weight)), hn::Set(d, 0x800080u));
  const auto g = hn::Add(hn::Add(hn::ShiftLeft<8>(g_a), hn::Mul(hn::Sub(g_b, g_a), weight)), hn::Set(d, 0x80u));
  return hn::Or(hn::And(hn::ShiftRight<8>(rb), red_blue), hn::And(g, hn::Set(d, 0xff00u)));
}

void Mix(const uint32_t* HWY_RESTRICT a, const uint32_t* HWY_RESTRICT b, uint32_t weight, size_t pixels,
         uint32_t* HWY_RESTRICT out) {
  const hn::CappedTag<uint32_t, 16> d;
  const auto w = hn::Set(d, weight);
  for (size_t x = 0; x < pixels; x += hn::Lanes(d))
    hn::StoreU(Between(hn::LoadU(d, a + x), hn::LoadU(d, b + x), w), d, out + x);
}

void MixPairs(const uint32_t* HWY_RESTRICT pairs, const uint32_t* HWY_RESTRICT weights, size_t pixels,
              uint32_t* HWY_RESTRICT out) {
  const hn::CappedTag<uint32_t, 16> d;
  for (size_t x = 0; x < pixels; x += hn::Lanes(d)) {
    hn::Vec<decltype(d)> a, b;
    hn::LoadInterleaved2(d, pairs + 2 * x, a, b);
    hn::StoreU(Between(a, b, hn::LoadU(d, weights + x)), d, out + x);
  }
}

}  // namespace telesplat::stereo::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::stereo::detail {

HWY_EXPORT(SharePixels);
HWY_EXPORT(Mix);
HWY_EXPORT(MixPairs);

void share_pixels(const Sharing& sharing, int pixels, uint32_t* left, uint32_t* right) {
  HWY_DYNAMIC_DISPATCH(SharePixels)(sharing, pixels, left, right);
}

void mix(const uint32_t* a, const uint32_t* b, uint32_t weight, size_t pixels, uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(Mix)(a, b, weight, pixels, out);
}

void mix_pairs(const uint32_t* pairs, const uint32_t* weights, size_t pixels, uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(MixPairs)(pairs, weights, pixels, out);
}

}  // namespace telesplat::stereo::detail
#endif
