// The end of the kernel `ewa`: turns sums into shaded colours and infos.
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_EWA_RESOLVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_EWA_RESOLVE_INL_H_
#undef TELESPLAT_SPLAT_EWA_RESOLVE_INL_H_
#else
#define TELESPLAT_SPLAT_EWA_RESOLVE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "common/splat/surfel/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr float kNothingVisible = std::numeric_limits<float>::infinity();

// Computes ewa_colour and ewa_depth_code of whole rows. Empties the buffer's pixels while they are in the cache.
#if HWY_TARGET == HWY_SCALAR
void EwaResolve(const EwaLight& light, const EwaBuffer& buffer, const ResolvedTile& tile, int reach) {
  for (int y = 0; y < buffer.height; ++y)
    for (int x = 0; x < buffer.width; ++x) {
      const size_t at = static_cast<size_t>(y) * buffer.stride + x;
      float* v = buffer.sums.get() + 8 * at;
      const EwaSum sum{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
      const bool shown = buffer.visible[at] < kNothingVisible;
      tile.colour(y - reach)[x - reach] = shown ? ewa_colour(sum, light) : light.background;
      tile.info(y - reach)[x - reach] = shown ? ewa_depth_code(sum) << 8 : kEmptyInfo;
      std::fill_n(v, 8, 0.0f);
      buffer.visible[at] = kNothingVisible;
    }
}
#else
void EwaResolve(const EwaLight& light, const EwaBuffer& buffer, const ResolvedTile& tile, int reach) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  using V = hn::Vec<decltype(d)>;
  const size_t lanes = hn::Lanes(d);
  const auto one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  for (int y = 0; y < buffer.height; ++y) {
    uint32_t *colours = tile.colour(y - reach) - reach, *infos = tile.info(y - reach) - reach;
    for (size_t x = 0; x < static_cast<size_t>(buffer.width); x += lanes) {
      const size_t at = static_cast<size_t>(y) * buffer.stride + x;
      const auto shown = hn::Lt(hn::LoadU(d, buffer.visible.get() + at), hn::Set(d, kNothingVisible));
      const auto empty = hn::Set(du, kEmptyInfo), paper = hn::Set(du, light.background);
      if (hn::AllFalse(d, shown)) {
        hn::StoreU(paper, du, colours + x);
        hn::StoreU(empty, du, infos + x);
        // Empties sums, too: they may hold splats that lie on no visible surface.
        for (size_t i = 0; i < 8; ++i) hn::Store(hn::Zero(d), d, buffer.sums.get() + 8 * at + i * lanes);
        continue;
      }
      // Each pixel has two groups of four, which alternate in the loaded vectors.
      float* sum = buffer.sums.get() + 8 * at;
      V a0, a1, a2, a3, b0, b1, b2, b3;
      hn::LoadInterleaved4(d, sum, a0, a1, a2, a3);
      hn::LoadInterleaved4(d, sum + 4 * lanes, b0, b1, b2, b3);
      for (size_t i = 0; i < 8; ++i) hn::Store(hn::Zero(d), d, sum + i * lanes);
      hn::StoreU(hn::Set(d, kNothingVisible), d, buffer.visible.get() + at);
      const auto red = hn::ConcatEven(d, b0, a0), green = hn::ConcatEven(d, b1, a1), blue = hn::ConcatEven(d, b2, a2),
                 weight = hn::ConcatEven(d, b3, a3);
      const auto nx = hn::ConcatOdd(d, b0, a0), ny = hn::ConcatOdd(d, b1, a1), nz = hn::ConcatOdd(d, b2, a2),
                 codes = hn::ConcatOdd(d, b3, a3);
      const auto length2 = hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz));
      const auto scale = hn::Div(one, hn::Sqrt(hn::Max(length2, hn::Set(d, 1e-30f))));
      const auto head = hn::Mul(hn::Abs(nz), scale);
      const auto towards_key = hn::Add(
          hn::Add(hn::Mul(nx, hn::Set(d, light.key_direction[0])), hn::Mul(ny, hn::Set(d, light.key_direction[1]))),
          hn::Mul(nz, hn::Set(d, light.key_direction[2])));
      const auto key = hn::Max(hn::Mul(towards_key, scale), hn::Zero(d));
      const auto lit = hn::Add(hn::Add(hn::Set(d, light.ambient), hn::Mul(hn::Set(d, light.head), head)),
                               hn::Mul(hn::Set(d, light.key), key));
      const auto intensity = hn::Max(hn::Min(lit, one), hn::Zero(d));
      const auto per_weight = hn::Div(intensity, weight);
      const auto channel = [&](V v) HWY_ATTR {
        const auto c = hn::Min(hn::Add(hn::Mul(v, per_weight), half), hn::Set(d, 255.0f));
        return hn::BitCast(du, hn::ConvertTo(di, c));
      };
      const auto colour =
          hn::Or(hn::Or(hn::ShiftLeft<16>(channel(red)), hn::ShiftLeft<8>(channel(green))), channel(blue));
      const auto mean = hn::Min(hn::Add(hn::Div(codes, weight), half), hn::Set(d, static_cast<float>(kMaxDepthCode)));
      const auto code = hn::BitCast(du, hn::ConvertTo(di, hn::Max(mean, hn::Zero(d))));
      const auto is_shown = hn::RebindMask(du, shown);
      hn::StoreU(hn::IfThenElse(is_shown, colour, paper), du, colours + x);
      hn::StoreU(hn::IfThenElse(is_shown, hn::ShiftLeft<8>(code), empty), du, infos + x);
    }
  }
}

#endif

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
