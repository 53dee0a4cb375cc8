// Four floats of a voxel or pixel: (r, g, b, extinction). A vector if the target has vectors of four, else an array.
#if defined(TELESPLAT_SHEAR_QUAD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SHEAR_QUAD_INL_H_
#undef TELESPLAT_SHEAR_QUAD_INL_H_
#else
#define TELESPLAT_SHEAR_QUAD_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

struct Quad {
  float at[4];
};
inline Quad LoadQuad(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
inline Quad QuadOf(float v) { return {{v, v, v, v}}; }
inline void StoreQuad(Quad q, float* p) {
  for (int n = 0; n < 4; ++n) p[n] = q.at[n];
}
inline Quad Add(Quad a, Quad b) {
  for (int n = 0; n < 4; ++n) a.at[n] += b.at[n];
  return a;
}
inline Quad Sub(Quad a, Quad b) {
  for (int n = 0; n < 4; ++n) a.at[n] -= b.at[n];
  return a;
}
inline Quad Mul(Quad a, Quad b) {
  for (int n = 0; n < 4; ++n) a.at[n] *= b.at[n];
  return a;
}
inline void StoreTransposed(Quad p0, Quad p1, Quad p2, Quad p3, float* to, int stride) {
  for (int n = 0; n < 4; ++n) {
    float* p = to + n * stride;
    p[0] = p0.at[n], p[1] = p1.at[n], p[2] = p2.at[n], p[3] = p3.at[n];
  }
}

#else

using QuadTag = hn::FixedTag<float, 4>;
using Quad = hn::Vec<QuadTag>;
HWY_INLINE Quad LoadQuad(const float* p) { return hn::Load(QuadTag(), p); }
HWY_INLINE Quad QuadOf(float v) { return hn::Set(QuadTag(), v); }
HWY_INLINE void StoreQuad(Quad q, float* p) { hn::Store(q, QuadTag(), p); }
HWY_INLINE Quad Add(Quad a, Quad b) { return hn::Add(a, b); }
HWY_INLINE Quad Sub(Quad a, Quad b) { return hn::Sub(a, b); }
HWY_INLINE Quad Mul(Quad a, Quad b) { return hn::Mul(a, b); }

// Stores (r, g, b, e) of four voxels or pixels as four values of each channel, channels `stride` apart.
HWY_INLINE void StoreTransposed(Quad p0, Quad p1, Quad p2, Quad p3, float* to, int stride) {
  const QuadTag d;
  const auto rg0 = hn::InterleaveLower(d, p0, p1), rg1 = hn::InterleaveLower(d, p2, p3);
  const auto be0 = hn::InterleaveUpper(d, p0, p1), be1 = hn::InterleaveUpper(d, p2, p3);
  hn::Store(hn::ConcatLowerLower(d, rg1, rg0), d, to);
  hn::Store(hn::ConcatUpperUpper(d, rg1, rg0), d, to + stride);
  hn::Store(hn::ConcatLowerLower(d, be1, be0), d, to + 2 * stride);
  hn::Store(hn::ConcatUpperUpper(d, be1, be0), d, to + 3 * stride);
}

#endif

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
