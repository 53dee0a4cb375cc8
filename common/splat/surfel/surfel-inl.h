// The footprint of a sample on the screen: a point, its normal and the view that sampled it give an ellipse of pixels
// and the slope of depth across it (T4.4.1, eq. 4.2-4.7); many points at a time.
// Based on: M. Zwicker, J. Raesaenen, M. Botsch, C. Dachsbacher, M. Pauly, "Perspective accurate splatting", Graphics
// Interface 2004. We project the footprint in its dual form: the conic's adjugate, p p^T - V for a centre p and a
// footprint V in space, needs neither a basis of the tangent plane nor matrices to be inverted, and gives the bounding
// box at once. The contour is the same. Tests do the same operations in the same order on scalars, with the same bits.
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_SURFEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_SURFEL_INL_H_
#undef TELESPLAT_SPLAT_SURFEL_INL_H_
#else
#define TELESPLAT_SPLAT_SURFEL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/splat/projection-inl.h"
#include "common/splat/surfel/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

using VF = hn::Vec<F32>;
using VI = hn::Vec<I32>;
using VU = hn::Vec<U32>;

HWY_INLINE VF Const(float v) { return hn::Set(F32(), v); }
HWY_INLINE VF Clamp(VF v, VF lo, VF hi) { return hn::Max(hn::Min(v, hi), lo); }

// SurfelSource of each lane.
struct Sources {
  VF radius, x, y, z;
};

// A vector of points, and the footprint of each on the screen, in pixels: a pixel at offset d from the contour's centre
// is inside if d^T S^-1 d <= 1.
struct Surfels {
  VF x, y, w;                       // projected centre, depth
  VF rho;                           // radius over depth, limited
  VF offset_x, offset_y;            // from the projected centre to the ellipse's centre
  VF xx, xy, yy;                    // S
  VF slope_x, slope_y;              // depth of the tangent plane = w / (1 + slope . offset from the projected centre)
  VF normal_x, normal_y, normal_z;  // in camera axes, not of unit length
  VU normal_code, albedo;
};

HWY_INLINE VF Dot(const std::array<float, 3>& a, VF x, VF y, VF z) {
  return hn::Add(hn::Add(hn::Mul(Const(a[0]), x), hn::Mul(Const(a[1]), y)), hn::Mul(Const(a[2]), z));
}
HWY_INLINE VF Dot(VF ax, VF ay, VF az, VF x, VF y, VF z) {
  return hn::Add(hn::Add(hn::Mul(ax, x), hn::Mul(ay, y)), hn::Mul(az, z));
}

// surfel_normal, in room space.
HWY_INLINE void DecodeNormals(VU code, VF& x, VF& y, VF& z) {
  const F32 d;
  const I32 di;
  const auto at = [&](VU c) HWY_ATTR {
    return hn::Min(hn::Sub(hn::ConvertTo(d, hn::BitCast(di, c)), Const(127.0f)), Const(127.0f));
  };
  x = at(hn::And(code, hn::Set(U32(), 255u)));
  y = at(hn::ShiftRight<8>(code));
  z = hn::Sub(hn::Sub(Const(127.0f), hn::Abs(x)), hn::Abs(y));
  const auto fold = hn::Max(hn::Neg(z), hn::Zero(d));
  x = hn::Sub(x, hn::CopySign(fold, x));
  y = hn::Sub(y, hn::CopySign(fold, y));
}

// Preconditions: x, y, w and normal_code of s are set.
// With m the normal, i = 1 / m.m, n n^T = i m m^T, e the direction to the sampling view and d = e - (e.n) n, the
// footprint is
//   V = radius^2 (I - n n^T + kappa d d^T),  kappa = 1 / max((e.n)^2, kMinSampledCosine^2)
// a circle stretched along the slope by 1 / (e.n), or by sqrt(1 + |d|^2 / kMinSampledCosine^2) beyond the limit. With
// T the shift of image coordinates by (u, v), s = T m, t = T d:
//   G = T T^T - i s s^T + kappa t t^T,   dual conic about the projected centre: diag(0, 0, 1) - (radius / w)^2 G
// and its centre and S follow as k = 1 - (radius / w)^2 Gzz divides. Where the splat reaches the eye (k < 1/4) its
// projection is taken as parallel. No low-pass is added to S.
HWY_INLINE void ContourOf(const SurfelCamera& c, const Sources& e, Surfels& s) {
  const auto one = Const(1.0f);
  VF nx, ny, nz;
  DecodeNormals(s.normal_code, nx, ny, nz);
  const auto mx = Dot(c.right, nx, ny, nz), my = Dot(c.down, nx, ny, nz), mz = Dot(c.forward, nx, ny, nz);
  const auto u = hn::Mul(hn::Sub(s.x, Const(c.centre_x)), Const(c.step_x));
  const auto v = hn::Mul(hn::Sub(s.y, Const(c.centre_y)), Const(c.step_y));

  const auto sx = hn::Sub(mx, hn::Mul(u, mz)), sy = hn::Sub(my, hn::Mul(v, mz));
  const auto i = hn::Div(one, hn::Add(hn::Add(hn::Mul(mx, mx), hn::Mul(my, my)), hn::Mul(mz, mz)));
  const auto em = Dot(mx, my, mz, e.x, e.y, e.z), em_i = hn::Mul(em, i);
  const auto kappa = hn::Div(one, hn::Max(hn::Mul(em, em_i), Const(kMinSampledCosine * kMinSampledCosine)));
  const auto tx = hn::Sub(hn::Sub(e.x, hn::Mul(u, e.z)), hn::Mul(em_i, sx));
  const auto ty = hn::Sub(hn::Sub(e.y, hn::Mul(v, e.z)), hn::Mul(em_i, sy));
  const auto tz = hn::Sub(e.z, hn::Mul(em_i, mz));

  const auto isx = hn::Mul(i, sx), isy = hn::Mul(i, sy), isz = hn::Mul(i, mz);
  const auto ktx = hn::Mul(kappa, tx), kty = hn::Mul(kappa, ty), ktz = hn::Mul(kappa, tz);
  const auto gxx = hn::Add(hn::Sub(hn::Add(one, hn::Mul(u, u)), hn::Mul(isx, sx)), hn::Mul(ktx, tx));
  const auto gyy = hn::Add(hn::Sub(hn::Add(one, hn::Mul(v, v)), hn::Mul(isy, sy)), hn::Mul(kty, ty));
  const auto gxy = hn::Add(hn::Sub(hn::Mul(u, v), hn::Mul(isx, sy)), hn::Mul(ktx, ty));
  const auto gxz = hn::Sub(hn::Sub(hn::Mul(ktx, tz), hn::Mul(isx, mz)), u);
  const auto gyz = hn::Sub(hn::Sub(hn::Mul(kty, tz), hn::Mul(isy, mz)), v);
  const auto gzz = hn::Add(hn::Sub(one, hn::Mul(isz, mz)), hn::Mul(ktz, tz));

  const auto rho = hn::Min(hn::Div(e.radius, s.w), Const(kMaxRadiusOverDepth)), rho2 = hn::Mul(rho, rho);
  const auto k = hn::Sub(one, hn::Mul(rho2, gzz));
  const auto parallel = hn::Lt(k, Const(0.25f));
  const auto a = hn::Div(rho2, hn::IfThenElse(parallel, one, k)), shift = hn::IfThenZeroElse(parallel, a);
  const auto fx = Const(c.focal_x), fy = Const(c.focal_y);
  const auto ax = hn::Mul(a, fx), ay = hn::Mul(a, fy);
  s.rho = rho;
  s.offset_x = hn::Neg(hn::Mul(hn::Mul(shift, fx), gxz));
  s.offset_y = hn::Neg(hn::Mul(hn::Mul(shift, fy), gyz));
  s.xx = hn::Add(hn::Mul(hn::Mul(ax, fx), gxx), hn::Mul(s.offset_x, s.offset_x));
  s.xy = hn::Add(hn::Mul(hn::Mul(ax, fy), gxy), hn::Mul(s.offset_x, s.offset_y));
  s.yy = hn::Add(hn::Mul(hn::Mul(ay, fy), gyy), hn::Mul(s.offset_y, s.offset_y));

  // The tangent plane is m . P = m . p, with P on the ray through the pixel. A plane seen edge-on gets the steepest
  // slope.
  const auto along = hn::Add(hn::Add(hn::Mul(mx, u), hn::Mul(my, v)), mz);
  const auto inverse = hn::Div(one, hn::CopySign(hn::Max(hn::Abs(along), Const(1e-3f)), along));
  const auto limit_x = Const(kSteepest * c.step_x), limit_y = Const(kSteepest * c.step_y);
  s.slope_x = Clamp(hn::Mul(hn::Mul(mx, inverse), Const(c.step_x)), hn::Neg(limit_x), limit_x);
  s.slope_y = Clamp(hn::Mul(hn::Mul(my, inverse), Const(c.step_y)), hn::Neg(limit_y), limit_y);
  s.normal_x = mx, s.normal_y = my, s.normal_z = mz;
}

// The conic of grow S + add I: d^T S^-1 d = dx (xx dx + xy dy) + yy dy dy about the centre, in pixels of the image. Its
// box [x0, x1) x [y0, y1) holds the pixels whose centres lie in it, cut to kMaxSplatSide and to the rectangle.
struct Conics {
  VF centre_x, centre_y, xx, xy, yy, determinant;  // centre and matrix of the conic; determinant of S
  VI x0, y0, x1, y1;
  VI pixel_x, pixel_y;  // pixel that holds the centre
  hn::Mask<I32> cut;    // the box was cut to kMaxSplatSide
};
HWY_INLINE Conics ConicOf(const Surfels& s, VF grow, float add, const geometry::Rect& rect) {
  const I32 di;
  Conics c;
  constexpr int kHalf = kMaxSplatSide / 2;
  const auto farthest = Const(kHalf - 1);  // binning allows for no more
  c.centre_x = hn::Add(s.x, Clamp(s.offset_x, hn::Neg(farthest), farthest));
  c.centre_y = hn::Add(s.y, Clamp(s.offset_y, hn::Neg(farthest), farthest));
  const auto xx = hn::Add(hn::Mul(grow, s.xx), Const(add)), xy = hn::Mul(grow, s.xy),
             yy = hn::Add(hn::Mul(grow, s.yy), Const(add));
  c.determinant = hn::Sub(hn::Mul(xx, yy), hn::Mul(xy, xy));
  const auto inverse = hn::Div(Const(1.0f), c.determinant);
  c.xx = hn::Mul(yy, inverse), c.xy = hn::Mul(hn::Mul(xy, Const(-2.0f)), inverse), c.yy = hn::Mul(xx, inverse);
  const auto bounds = [&](VF centre, VF variance, int low, int size, VI& pixel, VI& first, VI& last) HWY_ATTR {
    const auto reach = hn::Min(hn::Sqrt(variance), Const(64.0f));  // far beyond the cut, and small enough to convert
    const auto from = hn::Sub(centre, Const(0.5f));
    pixel = hn::ConvertTo(di, hn::Floor(centre));
    first = hn::ConvertTo(di, hn::Ceil(hn::Sub(from, reach)));
    last = hn::Add(hn::ConvertTo(di, hn::Floor(hn::Add(from, reach))), hn::Set(di, 1));
    const auto least = hn::Sub(pixel, hn::Set(di, kHalf - 1)), most = hn::Add(pixel, hn::Set(di, kHalf + 1));
    const auto cut = hn::Or(hn::Lt(first, least), hn::Gt(last, most));
    first = hn::Max(hn::Max(first, least), hn::Set(di, low));
    last = hn::Min(hn::Min(last, most), hn::Set(di, low + size));
    return cut;
  };
  const auto cut_x = bounds(c.centre_x, xx, rect.x, rect.width, c.pixel_x, c.x0, c.x1);
  const auto cut_y = bounds(c.centre_y, yy, rect.y, rect.height, c.pixel_y, c.y0, c.y1);
  c.cut = hn::Or(cut_x, cut_y);
  return c;
}

// Lanes whose centre's pixel lies in the rectangle.
HWY_INLINE hn::Mask<I32> CentreIn(const Conics& c, const geometry::Rect& r) {
  const I32 di;
  return hn::And(hn::And(hn::Gt(c.pixel_x, hn::Set(di, r.x - 1)), hn::Lt(c.pixel_x, hn::Set(di, r.x + r.width))),
                 hn::And(hn::Gt(c.pixel_y, hn::Set(di, r.y - 1)), hn::Lt(c.pixel_y, hn::Set(di, r.y + r.height))));
}

// d^T S^-1 d.
template <class V>
HWY_INLINE V At(V xx, V xy, V yy, V dx, V dy) {
  return hn::Add(hn::Mul(dx, hn::Add(hn::Mul(xx, dx), hn::Mul(xy, dy))), hn::Mul(hn::Mul(yy, dy), dy));
}

HWY_INLINE VF CodesPerDepth(VF w) {
  const U32 du;
  return hn::BitCast(F32(), hn::Or(hn::And(hn::BitCast(du, w), hn::Set(du, 0x007fffffu)), hn::Set(du, 0x46800000u)));
}

// The depth code across a splat: centre + x dx + y dy, offsets from the conic's centre. Codes are not rounded: 2^14 an
// octave, linear inside it.
struct Depths {
  VF centre, x, y;
};
HWY_INLINE Depths DepthsOf(const Surfels& s, float near_m) {
  const U32 du;
  const auto scale = hn::Neg(CodesPerDepth(s.w));
  const auto bits = hn::Sub(hn::BitCast(du, s.w), hn::Set(du, std::bit_cast<uint32_t>(near_m)));
  const auto code = hn::Mul(hn::ConvertTo(F32(), hn::BitCast(I32(), bits)), Const(1.0f / (1 << kDepthCodeShift)));
  const auto x = hn::Mul(scale, s.slope_x), y = hn::Mul(scale, s.slope_y);
  return {hn::Add(hn::Add(code, hn::Mul(x, s.offset_x)), hn::Mul(y, s.offset_y)), x, y};
}

// surfel_share.
HWY_INLINE VF ShareOf(const Surfels& s, float factor, float least, float most) {
  return hn::Mul(CodesPerDepth(s.w), Clamp(hn::Mul(Const(factor), s.rho), Const(least), Const(most)));
}

HWY_INLINE VF DeterminantOf(const Surfels& s) { return hn::Sub(hn::Mul(s.xx, s.yy), hn::Mul(s.xy, s.xy)); }

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
