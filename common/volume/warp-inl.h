// Included once a target, by warp_kernels.cpp. What is computed stands in warp_kernels.h and warper.h; this is how, with every rounding:
//
//   place    cell = trunc(clamp(X / W + shift)), texel cell >> 7, weights of 128ths fx, fy = cell & 127
//   look-up  row(y) = (128 - fx) c(x, y) + fx c(x + 1, y);  c = row(y) + round((row(y + 1) - row(y)) fy / 128), so 255 is 32640
//   over     T = 32640 - A, 0 if below 64;  C += round(c (T + T / 256) / 32768), saturated; the same for A
//   at last  the background's colour like a layer's; colour = (min(C, 32640) + 64) >> 7
//
// Sums of products of 8-bit numbers, signed by unsigned, are one instruction, if colours are taken less 128: since weights add up to 128, so is what
// comes out.
#if defined(TELESPLAT_WARP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_WARP_INL_H_
#undef TELESPLAT_WARP_INL_H_
#else
#define TELESPLAT_WARP_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "common/volume/warp_kernels.h"
#include "common/volume/warp_pixel.h"
#include "common/volume/warper.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::volume::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using U8 = hn::ScalableTag<uint8_t>;
using S16 = hn::ScalableTag<int16_t>;
using U16 = hn::ScalableTag<uint16_t>;
using S32 = hn::ScalableTag<int32_t>;
using U32 = hn::ScalableTag<uint32_t>;
using F32 = hn::ScalableTag<float>;

#if HWY_TARGET == HWY_SCALAR

template <bool kDepth>
HWY_INLINE hn::Vec<U32> WarpVector(const WarpTile& tile, uint64_t layers, int x, int y, float* depth,
                                   uint64_t& samples) {
  const WarpedPixel pixel = warp_pixel(tile, layers, x, y, samples);
  if constexpr (kDepth) *depth = pixel.depth_m;
  return hn::Set(U32(), pixel.colour);
}

#else

// Four channels of 16 bits a pixel take two vectors. In each block of 128 bits `first` has the first two of the block's four pixels.
struct Wide {
  hn::Vec<S16> first, second;
};

HWY_INLINE hn::Vec<U8> Table(const uint8_t* table) { return hn::LoadDup128(U8(), table); }

// Bytes of two neighbouring texels, for two pixels -> pairs of the same channel.
alignas(16) constexpr uint8_t kPairs[16] = {0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15};
// The fourth of a pixel's words, four times.
alignas(16) constexpr uint8_t kAlpha[16] = {6, 7, 6, 7, 6, 7, 6, 7, 14, 15, 14, 15, 14, 15, 14, 15};
// Low bytes of words, into the lower or upper half of a block.
alignas(16) constexpr uint8_t kLowBytes[16] = {0, 2, 4, 6, 8, 10, 12, 14, 128, 128, 128, 128, 128, 128, 128, 128};
alignas(16) constexpr uint8_t kHighBytes[16] = {128, 128, 128, 128, 128, 128, 128, 128, 0, 2, 4, 6, 8, 10, 12, 14};
// A pixel's first word as 32 bits, likewise.
alignas(16) constexpr uint8_t kLowWords[16] = {0, 1, 128, 128, 8, 9, 128, 128, 128, 128, 128, 128, 128, 128, 128, 128};
alignas(16) constexpr uint8_t kHighWords[16] = {128, 128, 128, 128, 128, 128, 128, 128, 0, 1, 128, 128, 8, 9, 128, 128};

HWY_INLINE hn::Vec<S16> Shuffled(hn::Vec<S16> v, const uint8_t* table) {
  return hn::BitCast(S16(), hn::TableLookupBytesOr0(hn::BitCast(U8(), v), Table(table)));
}

// weights' even byte times colours' even byte plus the same of the odd ones. Weights are unsigned, colours signed.
HWY_INLINE hn::Vec<S16> SumOfPairs(hn::Vec<S16> weights, hn::Vec<S16> colours) {
#if HWY_TARGET == HWY_SSSE3 || HWY_TARGET == HWY_SSE4
  return hn::Vec<S16>{_mm_maddubs_epi16(weights.raw, colours.raw)};
#elif HWY_TARGET == HWY_AVX2
  return hn::Vec<S16>{_mm256_maddubs_epi16(weights.raw, colours.raw)};
#elif HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  return hn::Vec<S16>{_mm512_maddubs_epi16(weights.raw, colours.raw)};
#else
  const auto even = hn::Mul(hn::And(weights, hn::Set(S16(), 255)), hn::ShiftRight<8>(hn::ShiftLeft<8>(colours)));
  const auto odd_weights = hn::BitCast(S16(), hn::ShiftRight<8>(hn::BitCast(U16(), weights)));
  return hn::Add(even, hn::Mul(odd_weights, hn::ShiftRight<8>(colours)));
#endif
}

using Pair = hn::FixedTag<uint32_t, 2>;

// Texels at + 0 and + 1 of two places.
HWY_INLINE hn::Vec<hn::FixedTag<uint32_t, 4> > LoadTwo(const uint32_t* texels, int a, int b) {
  return hn::Combine(hn::FixedTag<uint32_t, 4>(), hn::LoadU(Pair(), texels + b), hn::LoadU(Pair(), texels + a));
}

// The texels at + 0 and + 1 of each pixel's place: of the first pixels of each block if kFirst, else of the second; less 128, in pairs.
template <bool kFirst>
HWY_INLINE hn::Vec<S16> LoadPairs(const uint32_t* texels, const int32_t* at) {
  constexpr int k = kFirst ? 0 : 2;
  const auto block = [&](int b) HWY_ATTR { return LoadTwo(texels, at[4 * b + k], at[4 * b + k + 1]); };
#if HWY_MAX_BYTES == 16
  const auto loaded = block(0);
#elif HWY_MAX_BYTES == 32
  const auto loaded = hn::Combine(U32(), block(1), block(0));
#elif HWY_MAX_BYTES == 64
  const hn::FixedTag<uint32_t, 8> half;
  const auto loaded = hn::Combine(U32(), hn::Combine(half, block(3), block(2)), hn::Combine(half, block(1), block(0)));
#else
#error "Vectors of 16, 32 or 64 bytes."
#endif
  const auto less = hn::Xor(hn::BitCast(U8(), loaded), hn::Set(U8(), 0x80));
  return Shuffled(hn::BitCast(S16(), less), kPairs);
}

// A word a pixel, in both halves of 32 bits -> four words a pixel.
HWY_INLINE Wide Spread(hn::Vec<U32> twice) {
  const U32 d;
  return {hn::BitCast(S16(), hn::InterleaveLower(d, twice, twice)),
          hn::BitCast(S16(), hn::InterleaveUpper(d, twice, twice))};
}

HWY_INLINE hn::Vec<S16> Between(hn::Vec<S16> weights, hn::Vec<S16> upper, hn::Vec<S16> lower, hn::Vec<S16> down) {
  const auto a = SumOfPairs(weights, upper), b = SumOfPairs(weights, lower);
  return hn::Add(hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), down)), hn::Set(S16(), 16384));
}

// Bilinear look-up in 128ths of 8-bit steps. at_x, at_y: 128ths of texels, not negative.
HWY_INLINE Wide LookUp(const WarpLayer& layer, hn::Vec<S32> at_x, hn::Vec<S32> at_y) {
  const S32 d;
  const U32 du;
  HWY_ALIGN int32_t at[hn::MaxLanes(S32())];
  hn::Store(hn::Add(hn::Mul(hn::ShiftRight<7>(at_y), hn::Set(d, layer.pitch)), hn::ShiftRight<7>(at_x)), d, at);
  const auto low = hn::Set(d, kWarpSubtexels - 1);
  const auto fx = hn::And(at_x, low), fy = hn::And(at_y, low);
  // Bytes 128 - fx, fx; and fy / 128 as a fraction of 15 bits.
  const auto across = hn::BitCast(du, hn::Add(hn::Sub(hn::ShiftLeft<8>(fx), fx), hn::Set(d, kWarpSubtexels)));
  const auto along = hn::BitCast(du, hn::ShiftLeft<8>(fy));
  const Wide weights = Spread(hn::Or(across, hn::ShiftLeft<16>(across)));
  const Wide down = Spread(hn::Or(along, hn::ShiftLeft<16>(along)));
  const uint32_t *upper = layer.texels, *lower = layer.texels + layer.pitch;
  return {Between(weights.first, LoadPairs<true>(upper, at), LoadPairs<true>(lower, at), down.first),
          Between(weights.second, LoadPairs<false>(upper, at), LoadPairs<false>(lower, at), down.second)};
}

HWY_INLINE hn::Vec<S16> Transparency(hn::Vec<S16> sum) {
  return hn::Sub(hn::Set(S16(), kWarpOpaque), Shuffled(sum, kAlpha));
}

// As a fraction of 15 bits.
HWY_INLINE hn::Vec<S16> Factor(hn::Vec<S16> transparency) {
  const auto done = hn::Gt(hn::Set(S16(), kWarpDone), transparency);
  return hn::IfThenZeroElse(done, hn::Add(transparency, hn::ShiftRight<8>(transparency)));
}

HWY_INLINE hn::Vec<S16> Over(hn::Vec<S16> sum, hn::Vec<S16> factor, hn::Vec<S16> behind) {
  return hn::SaturatedAdd(sum, hn::MulFixedPoint15(behind, factor));
}

HWY_INLINE hn::Vec<S16> EightBits(hn::Vec<S16> sum) {
  const S16 d;
  return hn::ShiftRight<7>(hn::Add(hn::Min(sum, hn::Set(d, kWarpOpaque)), hn::Set(d, 64)));
}

// One vector of pixels, the first of them (x, y). depth: if kDepth, one a pixel.
template <bool kDepth>
HWY_INLINE hn::Vec<U32> WarpVector(const WarpTile& tile, uint64_t layers, int x, int y, float* depth,
                                   uint64_t& samples) {
  const F32 df;
  const S16 d;
  const U8 d8;
  const auto px = hn::Add(hn::Set(df, static_cast<float>(x)), hn::Iota(df, 0.0f));
  const auto py = hn::Set(df, static_cast<float>(y));
  Wide sum{hn::Zero(d), hn::Zero(d)};
  Wide factor{hn::Set(d, 32767), hn::Set(d, 32767)};
  const auto never = hn::Set(df, std::numeric_limits<float>::infinity());
  auto solid_at = never;
  for (uint64_t rest = layers; rest; rest &= rest - 1) {
    const WarpLayer& layer = tile.layers[std::countr_zero(rest)];
    samples += hn::Lanes(df);
    const auto linear = [&](float at_0, float step_x, float step_y) HWY_ATTR {
      const auto row = hn::Add(hn::Set(df, at_0), hn::Mul(py, hn::Set(df, step_y)));
      return hn::Add(row, hn::Mul(px, hn::Set(df, step_x)));
    };
    const auto w = linear(layer.w0, layer.wx, layer.wy);
    const auto nearest = hn::Set(df, kWarpNearestW);
    const auto inverse = hn::Div(hn::Set(df, 1.0f), hn::Max(w, nearest));
    const auto place = [&](hn::Vec<F32> numerator, float shift, float last) HWY_ATTR {
      const auto at = hn::Add(hn::Mul(numerator, inverse), hn::Set(df, shift));
      return hn::Min(hn::Max(at, hn::Zero(df)), hn::Set(df, last));
    };
    // Rays that do not meet the plane look at texel column 0, where nothing is.
    const auto at_x = hn::IfThenElseZero(hn::Ge(w, nearest),
                                         place(linear(layer.x0, layer.xx, layer.xy), layer.shift_x, layer.last_x));
    const auto at_y = place(linear(layer.y0, layer.yx, layer.yy), layer.shift_y, layer.last_y);
    const Wide seen = LookUp(layer, hn::ConvertTo(S32(), at_x), hn::ConvertTo(S32(), at_y));
    sum = {Over(sum.first, factor.first, seen.first), Over(sum.second, factor.second, seen.second)};
    const Wide left{Transparency(sum.first), Transparency(sum.second)};
    if constexpr (kDepth) {
      const auto all = hn::BitCast(S32(), hn::Or(Shuffled(left.first, kLowWords), Shuffled(left.second, kHighWords)));
      constexpr auto kLeft = static_cast<int32_t>(static_cast<float>(kWarpOpaque) * (1 - kSolid));
      const auto solid = hn::RebindMask(df, hn::Lt(all, hn::Set(S32(), kLeft + 1)));
      const auto here = hn::Mul(inverse, hn::Set(df, layer.depth));
      solid_at = hn::IfThenElse(hn::And(solid, hn::Eq(solid_at, never)), here, solid_at);
    }
    factor = {Factor(left.first), Factor(left.second)};
    if (hn::AllTrue(d, hn::Eq(hn::Or(factor.first, factor.second), hn::Zero(d)))) break;
  }
  if constexpr (kDepth) hn::Store(solid_at, df, depth);
  const U32 du;
  const auto background = hn::BitCast(d8, hn::Set(du, tile.background));
  // Words of eight bits, shifted into 128ths.
  const auto wide =
      hn::BitCast(d, hn::ShiftLeft<7>(hn::BitCast(U16(), hn::InterleaveLower(d8, background, hn::Zero(d8)))));
  const auto first = EightBits(Over(sum.first, factor.first, wide));
  const auto second = EightBits(Over(sum.second, factor.second, wide));
  const auto colour = hn::BitCast(du, hn::Or(Shuffled(first, kLowBytes), Shuffled(second, kHighBytes)));
  return hn::Or(colour, hn::Set(du, 0xff000000u));
}

#endif  // HWY_SCALAR

template <bool kDepth>
HWY_INLINE uint64_t WarpPartsAs(const WarpTile& tile) {
  const U32 d;
  const F32 df;
  const int lanes = static_cast<int>(hn::Lanes(d));
  HWY_ALIGN uint32_t colours[hn::MaxLanes(U32())];
  HWY_ALIGN float depths[hn::MaxLanes(F32())];
  uint64_t samples = 0;
  for (int part = 0; part < kWarpPartsX * kWarpPartsY; ++part) {
    const uint64_t layers = tile.parts[static_cast<size_t>(part)];
    const int left = part % kWarpPartsX * kWarpPartWidth, top = part / kWarpPartsX * kWarpPartHeight;
    const int begin = std::max(left, tile.x0), end = std::min(left + kWarpPartWidth, tile.x1);
    for (int y = std::max(top, tile.y0); y < std::min(top + kWarpPartHeight, tile.y1); ++y) {
      uint32_t* colour = tile.colour + y * tile.pitch;
      float* depth = kDepth ? tile.depth_m + y * tile.pitch : nullptr;
      if (!layers) {
        for (int x = begin; x < end; ++x) colour[x] = 0xff000000u | tile.background;
        for (int x = begin; kDepth && x < end; ++x) depth[x] = std::numeric_limits<float>::infinity();
        continue;
      }
      for (int x = left; x < end; x += lanes) {
        if (x + lanes <= begin) continue;
        const auto drawn = WarpVector<kDepth>(tile, layers, x, y, depths, samples);
        if (x >= begin && x + lanes <= end) {
          hn::StoreU(drawn, d, colour + x);
          if constexpr (kDepth) hn::StoreU(hn::Load(df, depths), df, depth + x);
          continue;
        }
        hn::Store(drawn, d, colours);
        for (int i = std::max(begin - x, 0); i < std::min(lanes, end - x); ++i) {
          colour[x + i] = colours[i];
          if constexpr (kDepth) depth[x + i] = depths[i];
        }
      }
    }
  }
  return samples;
}

uint64_t WarpParts(const WarpTile& tile) { return tile.depth_m ? WarpPartsAs<true>(tile) : WarpPartsAs<false>(tile); }

}  // namespace telesplat::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
