// Rounding of the computations that kernels.h and warper.h define:
//
//   place    in 128ths of texels: round(clamp(X / W)), by adding 2^23 in floats; texel place >> 7,
//            weights of 128ths fx, fy = place & 127
//   look-up  row(y) = (128 - fx) c(x, y) + fx c(x + 1, y)
//            c = row(y) + round((row(y + 1) - row(y)) fy / 128), so 255 is 32640
//   over     T = 32640 - A, 0 if below 64;  C += round(c (T + T / 256) / 32768), saturated; the same for A
//   at last  the background's colour like a layer's; colour = (min(C, 32640) + 64) >> 7
//
// Sums of products of 8-bit numbers, signed by unsigned, are one instruction if 128 is subtracted from colours: since
// weights add up to 128, the same 128 is missing from the result.
#include "common/volume/warp/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/volume/warp/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "common/volume/warp/pixel.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::volume::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using U8 = hn::ScalableTag<uint8_t>;
using S16 = hn::ScalableTag<int16_t>;
using U16 = hn::ScalableTag<uint16_t>;
using S32 = hn::ScalableTag<int32_t>;
using U32 = hn::ScalableTag<uint32_t>;
using F32 = hn::ScalableTag<float>;

constexpr int kPartPixels = kWarpPartWidth * kWarpPartHeight;

// Results of a part's pixels, and the places where they look up the current layer; pixels in order of rows.
struct PartPixels {
  HWY_ALIGN_MAX uint32_t colour[kPartPixels];
  HWY_ALIGN_MAX float depth_m[kPartPixels];
#if HWY_TARGET != HWY_SCALAR
  HWY_ALIGN_MAX int32_t at[kPartPixels];        // texel
  HWY_ALIGN_MAX uint32_t weights[kPartPixels];  // 128 - fx, fx, 0, 2 fy, a byte each
  HWY_ALIGN_MAX float inverse[kPartPixels];
  HWY_ALIGN_MAX int16_t sums[4 * kPartPixels], factors[4 * kPartPixels];  // a vector of pixels takes two: see Wide
#endif
};

#if HWY_TARGET == HWY_SCALAR

template <bool kDepth>
uint64_t WarpPart(const WarpTile& tile, uint64_t layers, int left, int top, PartPixels& out) {
  uint64_t samples = 0;
  for (int i = 0; i < kPartPixels; ++i) {
    const WarpedPixel pixel = warp_pixel(tile, layers, left + i % kWarpPartWidth, top + i / kWarpPartWidth, samples);
    out.colour[i] = pixel.colour;
    out.depth_m[i] = pixel.depth_m;
  }
  return samples;
}

#else

// Four channels of 16 bits a pixel take two vectors. In each block of 128 bits `first` has the first two of the block's
// four pixels.
struct Wide {
  hn::Vec<S16> first, second;
};

constexpr uint8_t kNone = 128;  // selects no byte: gives zero
// Bytes of two neighbouring texels, for two pixels -> pairs of the same channel.
alignas(16) constexpr uint8_t kPairs[16] = {0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15};
// The lower or upper half of a pixel's 32 bits, four times, for a block's first or second two pixels.
alignas(16) constexpr uint8_t kLowerOfFirst[16] = {0, 1, 0, 1, 0, 1, 0, 1, 4, 5, 4, 5, 4, 5, 4, 5};
alignas(16) constexpr uint8_t kUpperOfFirst[16] = {2, 3, 2, 3, 2, 3, 2, 3, 6, 7, 6, 7, 6, 7, 6, 7};
alignas(16) constexpr uint8_t kLowerOfSecond[16] = {8, 9, 8, 9, 8, 9, 8, 9, 12, 13, 12, 13, 12, 13, 12, 13};
alignas(16) constexpr uint8_t kUpperOfSecond[16] = {10, 11, 10, 11, 10, 11, 10, 11, 14, 15, 14, 15, 14, 15, 14, 15};
// The fourth of a pixel's words, four times.
alignas(16) constexpr uint8_t kAlpha[16] = {6, 7, 6, 7, 6, 7, 6, 7, 14, 15, 14, 15, 14, 15, 14, 15};
// Low bytes of words, moved into the lower or upper half of a block.
alignas(16) constexpr uint8_t kLowBytes[16] = {0,     2,     4,     6,     8,     10,    12,    14,
                                               kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
alignas(16) constexpr uint8_t kHighBytes[16] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone,
                                                0,     2,     4,     6,     8,     10,    12,    14};
// A pixel's first word as 32 bits, likewise.
alignas(16) constexpr uint8_t kLowWords[16] = {0,     1,     kNone, kNone, 8,     9,     kNone, kNone,
                                               kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
alignas(16) constexpr uint8_t kHighWords[16] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone,
                                                0,     1,     kNone, kNone, 8,     9,     kNone, kNone};

template <class V>
HWY_INLINE hn::Vec<S16> Shuffled(V v, const uint8_t* table) {
  const U8 d;
  return hn::BitCast(S16(), hn::TableLookupBytesOr0(hn::BitCast(d, v), hn::LoadDup128(d, table)));
}

// ---- place ----

// Computes at, weights and, if kInverse, inverse.
template <bool kInverse>
HWY_INLINE void Place(const WarpLayer& layer, int left, int top, PartPixels& part) {
  const F32 df;
  const S32 d;
  const int lanes = static_cast<int>(hn::Lanes(df));
  const auto nearest = hn::Set(df, kWarpNearestW), one = hn::Set(df, 1.0f);
  const auto low = hn::Set(d, kWarpSubtexels - 1), texels = hn::Set(d, kWarpMagicTexels);
  const auto step_x = hn::Set(df, layer.xx), step_y = hn::Set(df, layer.yx), step_w = hn::Set(df, layer.wx);
  const auto least_x = hn::Set(df, layer.least_x), most_x = hn::Set(df, layer.most_x);
  const auto least_y = hn::Set(df, layer.least_y), most_y = hn::Set(df, layer.most_y);
  const auto shift_x = hn::Set(df, layer.shift_x), shift_y = hn::Set(df, layer.shift_y);
  const auto pitch = hn::Set(d, layer.pitch);
  for (int y = 0; y < kWarpPartHeight; ++y) {
    const auto py = static_cast<float>(top + y);
    const auto row_x = hn::Set(df, layer.x0 + py * layer.xy), row_y = hn::Set(df, layer.y0 + py * layer.yy);
    const auto row_w = hn::Set(df, layer.w0 + py * layer.wy);
    for (int x = 0; x < kWarpPartWidth; x += lanes) {
      const int i = y * kWarpPartWidth + x;
      const auto px = hn::Iota(df, static_cast<float>(left + x));
      const auto w = hn::Add(row_w, hn::Mul(px, step_w));
      const auto inverse = hn::Div(one, hn::Max(w, nearest));
      const auto near_x = hn::Mul(hn::Add(row_x, hn::Mul(px, step_x)), inverse);
      const auto near_y = hn::Mul(hn::Add(row_y, hn::Mul(px, step_y)), inverse);
      // Rays that do not meet the plane look at texel column 0, which is empty.
      const auto in_x = hn::IfThenElse(hn::Ge(w, nearest), hn::Min(hn::Max(near_x, least_x), most_x), least_x);
      const auto in_y = hn::Min(hn::Max(near_y, least_y), most_y);
      const auto at_x = hn::BitCast(d, hn::Add(in_x, shift_x)), at_y = hn::BitCast(d, hn::Add(in_y, shift_y));
      const auto column = hn::And(hn::ShiftRight<7>(at_x), texels), row = hn::And(hn::ShiftRight<7>(at_y), texels);
      hn::Store(hn::Add(hn::Mul(row, pitch), column), d, part.at + i);
      const auto fx = hn::And(at_x, low), fy = hn::And(at_y, low);
      const auto across = hn::Add(hn::Sub(hn::ShiftLeft<8>(fx), fx), hn::Set(d, kWarpSubtexels));
      hn::Store(hn::BitCast(U32(), hn::Or(across, hn::ShiftLeft<24>(fy))), U32(), part.weights + i);
      if constexpr (kInverse) hn::Store(inverse, df, part.inverse + i);
    }
  }
}

// ---- look-up ----

// Multiplies even and odd bytes of weights (unsigned) and colours (signed); returns the sum of each pair of products.
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

// Loads texels at + 0 and + 1 of two places.
HWY_INLINE hn::Vec<hn::FixedTag<uint32_t, 4> > LoadTwo(const uint32_t* texels, const int32_t* at) {
  const hn::FixedTag<uint32_t, 2> pair;
  return hn::Combine(hn::FixedTag<uint32_t, 4>(), hn::LoadU(pair, texels + at[1]), hn::LoadU(pair, texels + at[0]));
}

// Loads texels at + 0 and + 1 of a block's first (at) or second (at + 2) two pixels; minus 128, in pairs.
HWY_INLINE hn::Vec<S16> LoadPairs(const uint32_t* texels, const int32_t* at) {
#if HWY_MAX_BYTES == 16
  const auto loaded = LoadTwo(texels, at);
#elif HWY_MAX_BYTES == 32
  const auto loaded = hn::Combine(U32(), LoadTwo(texels, at + 4), LoadTwo(texels, at));
#elif HWY_MAX_BYTES == 64
  const hn::FixedTag<uint32_t, 8> half;
  const auto lower = hn::Combine(half, LoadTwo(texels, at + 4), LoadTwo(texels, at));
  const auto upper = hn::Combine(half, LoadTwo(texels, at + 12), LoadTwo(texels, at + 8));
  const auto loaded = hn::Combine(U32(), upper, lower);
#else
#error "Vectors of 16, 32 or 64 bytes."
#endif
  return Shuffled(hn::Xor(hn::BitCast(U8(), loaded), hn::Set(U8(), 0x80)), kPairs);
}

HWY_INLINE hn::Vec<S16> Between(hn::Vec<S16> weights, hn::Vec<S16> upper, hn::Vec<S16> lower, hn::Vec<S16> down) {
  const auto a = SumOfPairs(weights, upper), b = SumOfPairs(weights, lower);
  return hn::Add(hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), down)), hn::Set(S16(), 16384));
}

// Looks up a vector of pixels, from `at` and `weights` on.
HWY_INLINE Wide LookUp(const WarpLayer& layer, const int32_t* at, const uint32_t* weights) {
  const auto w = hn::Load(U32(), weights);
  const uint32_t *upper = layer.texels, *lower = layer.texels + layer.pitch;
  return {Between(Shuffled(w, kLowerOfFirst), LoadPairs(upper, at), LoadPairs(lower, at), Shuffled(w, kUpperOfFirst)),
          Between(Shuffled(w, kLowerOfSecond), LoadPairs(upper, at + 2), LoadPairs(lower, at + 2),
                  Shuffled(w, kUpperOfSecond))};
}

// ---- over ----

HWY_INLINE hn::Vec<S16> Transparency(hn::Vec<S16> sum) {
  return hn::Sub(hn::Set(S16(), kWarpOpaque), Shuffled(sum, kAlpha));
}

// Converts it to a fraction of 15 bits.
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

// Adds the layer's samples behind those before. Returns false if nothing behind it can be seen any more.
template <bool kDepth>
HWY_INLINE bool Composite(const WarpLayer& layer, PartPixels& part) {
  const S16 d;
  const F32 df;
  const int lanes = static_cast<int>(hn::Lanes(df));
  const int half = static_cast<int>(hn::Lanes(d));
  auto any = hn::Zero(d);
  for (int i = 0; i < kPartPixels; i += lanes) {
    const Wide seen = LookUp(layer, part.at + i, part.weights + i);
    int16_t *sums = part.sums + 4 * i, *factors = part.factors + 4 * i;
    const auto first = Over(hn::Load(d, sums), hn::Load(d, factors), seen.first);
    const auto second = Over(hn::Load(d, sums + half), hn::Load(d, factors + half), seen.second);
    hn::Store(first, d, sums);
    hn::Store(second, d, sums + half);
    const auto left_first = Transparency(first), left_second = Transparency(second);
    if constexpr (kDepth) {
      const auto left = hn::BitCast(S32(), hn::Or(Shuffled(left_first, kLowWords), Shuffled(left_second, kHighWords)));
      const auto solid = hn::RebindMask(df, hn::Lt(left, hn::Set(S32(), kWarpSolid + 1)));
      const auto before = hn::Load(df, part.depth_m + i);
      const auto never = hn::Eq(before, hn::Set(df, std::numeric_limits<float>::infinity()));
      const auto here = hn::Mul(hn::Load(df, part.inverse + i), hn::Set(df, layer.depth));
      hn::Store(hn::IfThenElse(hn::And(solid, never), here, before), df, part.depth_m + i);
    }
    const auto factor_first = Factor(left_first), factor_second = Factor(left_second);
    hn::Store(factor_first, d, factors);
    hn::Store(factor_second, d, factors + half);
    any = hn::Or(any, hn::Or(factor_first, factor_second));
  }
  return !hn::AllTrue(d, hn::Eq(any, hn::Zero(d)));
}

template <bool kDepth>
uint64_t WarpPart(const WarpTile& tile, uint64_t layers, int left, int top, PartPixels& part) {
  const S16 d;
  const U8 d8;
  const U32 du;
  const F32 df;
  const int lanes = static_cast<int>(hn::Lanes(df)), half = static_cast<int>(hn::Lanes(d));
  for (int i = 0; i < 4 * kPartPixels; i += half) {
    hn::Store(hn::Zero(d), d, part.sums + i);
    hn::Store(hn::Set(d, 32767), d, part.factors + i);
  }
  for (int i = 0; kDepth && i < kPartPixels; i += lanes)
    hn::Store(hn::Set(df, std::numeric_limits<float>::infinity()), df, part.depth_m + i);
  uint64_t samples = 0;
  for (uint64_t rest = layers; rest; rest &= rest - 1) {
    const WarpLayer& layer = tile.layers[std::countr_zero(rest)];
    samples += kPartPixels;
    Place<kDepth>(layer, left, top, part);
    if (!Composite<kDepth>(layer, part)) break;
  }
  // Eight-bit words, shifted into 128ths.
  const auto bytes = hn::BitCast(d8, hn::Set(du, tile.background));
  const auto words = hn::BitCast(U16(), hn::InterleaveLower(d8, bytes, hn::Zero(d8)));
  const auto background = hn::BitCast(d, hn::ShiftLeft<7>(words));
  for (int i = 0; i < kPartPixels; i += lanes) {
    const int16_t *sums = part.sums + 4 * i, *factors = part.factors + 4 * i;
    const auto first = EightBits(Over(hn::Load(d, sums), hn::Load(d, factors), background));
    const auto second = EightBits(Over(hn::Load(d, sums + half), hn::Load(d, factors + half), background));
    const auto colour = hn::Or(Shuffled(first, kLowBytes), Shuffled(second, kHighBytes));
    hn::Store(hn::BitCast(du, colour), du, part.colour + i);
  }
  return samples;
}

#endif  // HWY_SCALAR

template <bool kDepth>
HWY_INLINE uint64_t WarpPartsAs(const WarpTile& tile) {
  PartPixels pixels;
  uint64_t samples = 0;
  for (int part = 0; part < kWarpPartsX * kWarpPartsY; ++part) {
    const uint64_t layers = tile.parts[static_cast<size_t>(part)];
    const int left = part % kWarpPartsX * kWarpPartWidth, top = part / kWarpPartsX * kWarpPartHeight;
    const int x0 = std::max(left, tile.x0), x1 = std::min(left + kWarpPartWidth, tile.x1);
    const int y0 = std::max(top, tile.y0), y1 = std::min(top + kWarpPartHeight, tile.y1);
    if (x0 >= x1 || y0 >= y1) continue;
    if (layers) samples += WarpPart<kDepth>(tile, layers, left, top, pixels);
    for (int y = y0; y < y1; ++y) {
      uint32_t* colour = tile.colour + y * tile.pitch + x0;
      float* depth = kDepth ? tile.depth_m + y * tile.pitch + x0 : nullptr;
      const int from = (y - top) * kWarpPartWidth + (x0 - left);
      if (layers) {
        std::copy_n(pixels.colour + from, x1 - x0, colour);
        if (kDepth) std::copy_n(pixels.depth_m + from, x1 - x0, depth);
      } else {
        std::fill_n(colour, x1 - x0, tile.background);
        if (kDepth) std::fill_n(depth, x1 - x0, std::numeric_limits<float>::infinity());
      }
    }
  }
  return samples;
}

uint64_t WarpParts(const WarpTile& tile) { return tile.depth_m ? WarpPartsAs<true>(tile) : WarpPartsAs<false>(tile); }

}  // namespace telesplat::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::volume {

HWY_EXPORT(WarpParts);

uint64_t warp_tile(const WarpTile& tile) { return HWY_DYNAMIC_DISPATCH(WarpParts)(tile); }

}  // namespace telesplat::volume
#endif
