// The distance estimate, a vector of points at a time. Included once for each target, by kernels.cpp. See julia/plain.h
// for the algorithm: operations and their order are the same, so that every target gives equal bits.
#if defined(TELESPLAT_JULIA_ESTIMATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_JULIA_ESTIMATE_INL_H_
#undef TELESPLAT_JULIA_ESTIMATE_INL_H_
#else
#define TELESPLAT_JULIA_ESTIMATE_INL_H_
#endif

#include <hwy/highway.h>

#include "services/sampler/julia/steps.h"
#include "services/sampler/julia/trace.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr size_t kMaxLanes = 16;
using F = hn::CappedTag<float, kMaxLanes>;
using I = hn::RebindToSigned<F>;
using VF = hn::Vec<F>;
using MF = hn::Mask<F>;
using Constants = JuliaScene::Constants;
constexpr F f;
constexpr I si;

HWY_INLINE VF set(float v) { return hn::Set(f, v); }

struct Vec4 {
  VF v[4];
};
struct Vec3 {
  VF v[3];
};

HWY_INLINE Vec4 along(const float* origin, const Vec4& d, VF t) {
  Vec4 q;
  for (int i = 0; i < 4; ++i) q.v[i] = hn::Add(set(origin[i]), hn::Mul(t, d.v[i]));
  return q;
}
HWY_INLINE Vec4 along(const Vec4& origin, const Vec4& d, VF t) {
  Vec4 q;
  for (int i = 0; i < 4; ++i) q.v[i] = hn::Add(origin.v[i], hn::Mul(t, d.v[i]));
  return q;
}
HWY_INLINE VF speed_of(const Vec4& d) {
  return hn::Mul(set(0.5f), hn::Sqrt(hn::Add(hn::Add(hn::Mul(d.v[0], d.v[0]), hn::Mul(d.v[1], d.v[1])),
                                             hn::Add(hn::Mul(d.v[2], d.v[2]), hn::Mul(d.v[3], d.v[3])))));
}

HWY_INLINE VF log_of(VF x) {
  const auto half = hn::Set(si, static_cast<int32_t>(kSqrtHalfBits));
  const auto offset = hn::Sub(hn::BitCast(si, x), half);
  const VF e = hn::ConvertTo(f, hn::ShiftRight<23>(offset));
  const VF m = hn::BitCast(f, hn::Add(hn::And(offset, hn::Set(si, 0x7fffff)), half));
  const VF s = hn::Div(hn::Sub(m, set(1)), hn::Add(m, set(1))), z = hn::Mul(s, s);
  const VF series = hn::Mul(z, hn::Add(set(kArtanh3), hn::Mul(z, hn::Add(set(kArtanh5), hn::Mul(z, set(kArtanh7))))));
  return hn::Add(hn::Mul(e, set(kLog2)), hn::Mul(hn::Add(s, s), hn::Add(set(1), series)));
}

// Estimates at kWays vectors of points at once: one alone would wait for its own results. Points that have escaped go
// on unmasked, towards infinity and then NaN, but never come back below the limit.
template <int kWays>
HWY_INLINE void Estimate(const Constants& k, const Vec4 (&q)[kWays], VF (&out)[kWays]) {
  const VF limit = set(k.limit), half = set(0.5f), c_w = set(k.c_w), c_p = set(k.c_p);
  VF w[kWays], p[kWays], r[kWays], d[kWays], last[kWays];
  MF live[kWays];
  for (int j = 0; j < kWays; ++j) {
    w[j] = q[j].v[0], p[j] = q[j].v[1];
    r[j] = hn::Add(hn::Mul(q[j].v[2], q[j].v[2]), hn::Mul(q[j].v[3], q[j].v[3]));
    d[j] = set(1), last[j] = limit;
    live[j] = hn::Le(limit, limit);
  }
  for (int i = 0; i <= k.iterations; ++i) {
    for (int j = 0; j < kWays; ++j) {
      const VF ww = hn::Mul(w[j], w[j]), n = hn::Add(ww, hn::Add(hn::Mul(p[j], p[j]), r[j]));
      last[j] = hn::IfThenElse(live[j], n, last[j]);
      live[j] = hn::Le(n, limit);
      d[j] = hn::IfThenElse(live[j], hn::Mul(d[j], n), d[j]);
      p[j] = hn::Add(hn::Mul(w[j], p[j]), c_p);
      r[j] = hn::Mul(ww, r[j]);
      w[j] = hn::Add(hn::Sub(ww, hn::Mul(n, half)), c_w);
    }
    MF any = live[0];
    for (int j = 1; j < kWays; ++j) any = hn::Or(any, live[j]);
    if (hn::AllFalse(f, any)) break;
  }
  for (int j = 0; j < kWays; ++j) {
    const VF e = hn::Mul(hn::Mul(set(0.125f), hn::Sqrt(hn::Div(last[j], d[j]))), log_of(hn::Mul(last[j], set(0.25f))));
    out[j] = hn::IfThenZeroElse(live[j], hn::Min(e, set(k.radius)));
  }
}

HWY_INLINE VF Estimate(const Constants& k, const Vec4& q) {
  const Vec4 points[1] = {q};
  VF out[1];
  Estimate<1>(k, points, out);
  return out[0];
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
