// The SIMD kernel of unproject.h, compiled for each instruction set.
#if defined(TELESPLAT_POINTS_UNPROJECT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_POINTS_UNPROJECT_INL_H_
#undef TELESPLAT_POINTS_UNPROJECT_INL_H_
#else
#define TELESPLAT_POINTS_UNPROJECT_INL_H_
#endif

#include <hwy/highway.h>

#include "common/points/unproject.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::points {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void unproject_row(const RowRays& rays, const uint32_t* codes, size_t n, ClusterKey* keys,
                   const std::array<uint16_t*, 3>& positions) {
  const hn::ScalableTag<double> df;
  const hn::Rebind<int32_t, decltype(df)> di;
  const hn::Rebind<uint16_t, decltype(df)> dh;
  const size_t lanes = hn::Lanes(df);
  const auto zero = hn::Zero(df), limit = hn::Set(df, rays.limit), scale = hn::Set(df, rays.depth_scale);

  size_t i = 0;
  for (; i + lanes <= n; i += lanes) {
    const auto code = hn::LoadU(di, reinterpret_cast<const int32_t*>(codes + i));
    // Most pixels of a patch are empty, in long runs.
    if (hn::AllTrue(di, hn::Eq(code, hn::Zero(di)))) {
      hn::StoreU(hn::Set(di, -1), di, reinterpret_cast<int32_t*>(keys + i));
      continue;
    }
    // Code 0 gives an infinite depth, hence coordinates that are infinite or NaN: outside.
    const auto depth = hn::Div(scale, hn::PromoteTo(df, code));
    const auto column = hn::Iota(df, rays.x_first + static_cast<double>(i));
    auto key = hn::Zero(di);
    auto inside = hn::Eq(zero, zero);
    for (int a = 0; a < 3; ++a) {
      const auto direction = hn::Add(hn::Set(df, rays.row[a]), hn::Mul(column, hn::Set(df, rays.step[a])));
      const auto g = hn::Add(hn::Set(df, rays.origin[a]), hn::Mul(depth, direction));
      inside = hn::And(inside, hn::And(hn::Ge(g, zero), hn::Lt(g, limit)));
      const auto q = hn::DemoteTo(di, g);  // truncates
      key = hn::Or(key, a == 0   ? hn::ShiftRight<16>(q)
                        : a == 1 ? hn::ShiftLeft<10>(hn::ShiftRight<16>(q))
                                 : hn::ShiftLeft<20>(hn::ShiftRight<16>(q)));
      hn::StoreU(hn::DemoteTo(dh, hn::And(q, hn::Set(di, 0xffff))), dh, positions[a] + i);
    }
    const auto outside = hn::DemoteTo(di, hn::IfThenElse(inside, zero, hn::Set(df, -1.0)));  // 0 or all ones
    hn::StoreU(hn::Or(key, outside), di, reinterpret_cast<int32_t*>(keys + i));
  }
  if (i < n) {
    RowRays rest = rays;
    rest.x_first += static_cast<double>(i);
    unproject_row_scalar(rest, codes + i, n - i, keys + i, {positions[0] + i, positions[1] + i, positions[2] + i});
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace telesplat::points
HWY_AFTER_NAMESPACE();

#endif
