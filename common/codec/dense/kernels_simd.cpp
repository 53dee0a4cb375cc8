// The same loops for every instruction set that Highway knows, and the coder of symbols with vectors.
#include <bit>
#include <cstring>

#include "common/codec/dense/kernels.h"

#ifndef TELESPLAT_CODEC_RANKS
#define TELESPLAT_CODEC_RANKS
namespace telesplat::codec::detail {
/// How many of the bits below each bit of a byte are set.
struct Ranks {
  alignas(32) int32_t of[256][8] = {};
  constexpr Ranks() {
    for (int bits = 0; bits < 256; ++bits)
      for (int i = 1; i < 8; ++i) of[bits][i] = of[bits][i - 1] + (bits >> (i - 1) & 1);
  }
};
inline constexpr Ranks kRanks;
/// Places of the bits that are set in a byte.
struct Places {
  alignas(32) int32_t of[256][8] = {};
  constexpr Places() {
    for (int bits = 0; bits < 256; ++bits)
      for (int i = 0, n = 0; i < 8; ++i)
        if (bits >> i & 1) of[bits][n++] = i;
  }
};
inline constexpr Places kPlaces;
}  // namespace telesplat::codec::detail
#endif

// AVX-512 as Ice Lake and Zen 4 have it: with bytes and words that are packed by masks, and looked up in tables.
// Highway 1.0.3 names AVX-VNNI for it, which neither has: tests/portable/instructions_test.py looks for that.
#define HWY_WANT_AVX3_DL
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/codec/dense/kernels_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#undef RESTRICT
#define RESTRICT HWY_RESTRICT

HWY_BEFORE_NAMESPACE();
namespace telesplat::codec::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#include "common/codec/dense/kernels-inl.h"
#include "common/codec/dense/rans-inl.h"

#if HWY_TARGET == HWY_SCALAR || HWY_HAVE_SCALABLE

static void CoveredBits(const uint32_t* depth, size_t n, uint64_t* words) {
  for (size_t x = 0; x < n; x += 64) {
    uint64_t word = 0;
    for (size_t i = 0; i < 64 && x + i < n; ++i) word |= uint64_t{depth[x + i] != 0} << i;
    words[x / 64] = word;
  }
}

static void CoverBytes(const uint64_t* words, size_t n, uint8_t* cover) {
  for (size_t x = 0; x < n; ++x) cover[x] = static_cast<uint8_t>(0 - (words[x / 64] >> x % 64 & 1));
}

static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  for (int i = 0; i < kFeatures; ++i)
    for (int j = 0; j <= i; ++j) {
      float sum = 0;
      for (size_t s = 0; s < n; ++s) sum += features[s][i] * (features[s][j] * weights[s]);
      sums[i][j] = sum;
    }
}

static void SampleShares(const float (*features)[kFeatures], const float* terms, size_t n, float least, bool squared,
                         float* shares) {
  for (size_t s = 0; s < (n + 3) / 4 * 4; ++s) {
    float parts[4] = {};
    for (int i = 0; i < kFeatures; ++i) parts[i % 4] = parts[i % 4] + terms[i] * features[s][i];
    const float off = (parts[0] + parts[1]) + (parts[2] + parts[3]), size = least + (off < 0 ? -off : off);
    shares[s] = 1 / (squared ? size * size : size);
  }
}

static const Kernels* Set() {
  static constexpr Kernels all{CoveredBits,
                               CoverBytes,
                               CutWide,
                               CutShort,
                               Pack<uint8_t>,
                               Pack<uint16_t>,
                               Pack<uint32_t>,
                               Unpack<uint8_t>,
                               UnpackWide,
                               KeepBytes,
                               FillValues,
                               Within,
                               LargestLessOne,
                               DepthResiduals,
                               DepthRows,
                               PlaneResiduals,
                               PlaneTerms,
                               PlaneKinds,
                               PlaneContexts,
                               Contexts,
                               JoinBytes,
                               OtherNormals,
                               TurnNormals,
                               TurnNormalsBack,
                               Divide,
                               UnfoldBytes,
                               UnfoldWide,
                               MedianResiduals,
                               GuidedResiduals<GuidedSums>,
                               GuidedResidualsWide<GuidedSums>,
                               MedianValues,
                               GuidedSums,
                               Flatness,
                               Geometry,
                               Heights,
                               Knots,
                               Activity,
                               NormalEquations,
                               SampleShares,
                               PlainSlots,
                               PlainPutSymbols,
                               PlainGetSymbols};
  return &all;
}

#else

using D = hn::CappedTag<uint32_t, 16>;
using V = hn::VFromD<D>;
using M = hn::Mask<D>;  // Highway 1.0.3 emulates no MFromD
constexpr D kD;
constexpr size_t kN = hn::MaxLanes(D()), kVectors = kLanes / kN;
constexpr hn::Rebind<uint16_t, D> kD16;
constexpr hn::Rebind<uint8_t, D> kD8;

// The lowest byte of each. (For AVX3_DL, TruncateTo() of Highway 1.0.3 takes others.)
HWY_INLINE hn::VFromD<decltype(kD8)> LowBytes(V v) {
#if HWY_TARGET <= HWY_AVX3
  return {_mm512_cvtepi32_epi8(v.raw)};
#else
  return hn::TruncateTo(kD8, v);
#endif
}

// The elements of v where `from` is set, in order, first. (Highway 1.0.3 copies its tables to the stack each time.)
HWY_INLINE V Gathered(V v, M from) {
#if HWY_TARGET <= HWY_AVX3
  return V{_mm512_maskz_compress_epi32(from.raw, v.raw)};
#else
  uint8_t bits[8] = {};
  hn::StoreMaskBits(kD, from, bits);
  return hn::TableLookupLanes(v, hn::SetTableIndices(kD, kPlaces.of[bits[0]]));
#endif
}

static void CoveredBits(const uint32_t* HWY_RESTRICT depth, size_t n, uint64_t* HWY_RESTRICT words) {
  for (size_t x = 0; x < n; x += 64) {
    const size_t bits = HWY_MIN(size_t{64}, n - x);
    uint64_t word = 0;
    size_t i = 0;
    for (; i + kN <= bits; i += kN) {
      uint8_t part[8] = {};  // as StoreMaskBits wants
      hn::StoreMaskBits(kD, hn::Ne(hn::LoadU(kD, depth + x + i), hn::Zero(kD)), part);
      word |= (uint64_t{part[0]} | uint64_t{part[1]} << 8) << i;
    }
    for (; i < bits; ++i) word |= uint64_t{depth[x + i] != 0} << i;
    words[x / 64] = word;
  }
}

static void CoverBytes(const uint64_t* HWY_RESTRICT words, size_t n, uint8_t* HWY_RESTRICT cover) {
  const hn::CappedTag<uint8_t, 64> d;
  for (size_t x = 0; x < n; x += hn::Lanes(d)) {
    const uint64_t bits = words[x / 64] >> x % 64;
    hn::StoreU(hn::VecFromMask(d, hn::LoadMaskBits(d, reinterpret_cast<const uint8_t*>(&bits))), d, cover + x);
  }
}

#include "common/codec/dense/vectors/pack-inl.h"
#include "common/codec/dense/vectors/rans-inl.h"

#include "common/codec/dense/vectors/planes-inl.h"

// A running sum of what the differences from the row above change by.
static void DepthRowsVector(const uint32_t* HWY_RESTRICT above, const uint32_t* HWY_RESTRICT z, size_t n,
                            uint32_t* HWY_RESTRICT row) {
  const hn::FixedTag<uint32_t, 4> d;
  const auto one = hn::Set(d, 1u), most = hn::Set(d, 0xFFFFFFu);
  auto before = hn::Set(d, row[-1] - above[-1]);
  for (size_t x = 0; x < n; x += 4) {
    const auto folded = hn::LoadU(d, z + x);
    auto sum = hn::Xor(hn::ShiftRight<1>(folded), hn::Sub(hn::Zero(d), hn::And(folded, one)));
    sum = hn::Add(sum, hn::ShiftLeftLanes<1>(d, sum));
    sum = hn::Add(sum, hn::ShiftLeftLanes<2>(d, sum));
    sum = hn::Add(sum, before);
    before = hn::Broadcast<3>(sum);
    hn::StoreU(hn::And(hn::Add(hn::LoadU(d, above + x), sum), most), d, row + x);
  }
}

// Eight rows by one vector at a time, which fit into registers.
template <class T>
HWY_INLINE void EightRows(T d, const float (*features)[kFeatures], const float* weights, size_t n, int i, int j,
                          float (*sums)[kFeatures]) {
  auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
  for (size_t s = 0; s < n; ++s) {
    const float* const f = features[s] + i;
    const auto v = hn::Mul(hn::LoadU(d, features[s] + j), hn::Set(d, weights[s]));
    const auto add = [&](auto& sum, int k) HWY_ATTR { sum = hn::Add(sum, hn::Mul(hn::Set(d, f[k]), v)); };
    add(s0, 0), add(s1, 1), add(s2, 2), add(s3, 3), add(s4, 4), add(s5, 5), add(s6, 6), add(s7, 7);
  }
  hn::StoreU(s0, d, sums[i] + j), hn::StoreU(s1, d, sums[i + 1] + j), hn::StoreU(s2, d, sums[i + 2] + j);
  hn::StoreU(s3, d, sums[i + 3] + j), hn::StoreU(s4, d, sums[i + 4] + j), hn::StoreU(s5, d, sums[i + 5] + j);
  hn::StoreU(s6, d, sums[i + 6] + j), hn::StoreU(s7, d, sums[i + 7] + j);
}

// Of the first rows the upper half of the columns is not wanted.
static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  const hn::CappedTag<float, 8> half;
  const hn::CappedTag<float, 16> d;
  for (int j = 0; j < 8; j += static_cast<int>(hn::Lanes(half))) EightRows(half, features, weights, n, 0, j, sums);
  for (int j = 0; j < 16; j += static_cast<int>(hn::Lanes(d))) EightRows(d, features, weights, n, 8, j, sums);
}

// table[i] of each i below 64. Tables in registers where there are any: gathers take longer.
HWY_INLINE hn::VFromD<hn::RebindToSigned<D> > KnotsAt(const int32_t* table, hn::VFromD<hn::RebindToSigned<D> > i) {
  const hn::RebindToSigned<D> d;
#if HWY_TARGET <= HWY_AVX2
  const auto part = [&](int k) HWY_ATTR { return hn::Load(d, table + static_cast<int>(kN) * k).raw; };
#endif
#if HWY_TARGET <= HWY_AVX3
  const __m512i low = _mm512_permutex2var_epi32(part(0), i.raw, part(1)),
                high = _mm512_permutex2var_epi32(part(2), i.raw, part(3));
  const __mmask16 upper = _mm512_test_epi32_mask(i.raw, _mm512_set1_epi32(32));
  return hn::VFromD<decltype(d)>{_mm512_mask_mov_epi32(low, upper, high)};
#elif HWY_TARGET == HWY_AVX2
  const auto eight = [&](int k) HWY_ATTR { return _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(part(k), i.raw)); };
  // Those of the first table where that bit of i is 0, else of the second.
  const auto by_bit = [&](__m256i bit, __m256 first, __m256 second)
                          HWY_ATTR { return _mm256_blendv_ps(first, second, _mm256_castsi256_ps(bit)); };
  const __m256i bit3 = _mm256_slli_epi32(i.raw, 28), bit4 = _mm256_slli_epi32(i.raw, 27),
                bit5 = _mm256_slli_epi32(i.raw, 26);
  const auto sixteen = [&](int k) HWY_ATTR { return by_bit(bit3, eight(2 * k), eight(2 * k + 1)); };
  const __m256 low = by_bit(bit4, sixteen(0), sixteen(1)), high = by_bit(bit4, sixteen(2), sixteen(3));
  return hn::VFromD<decltype(d)>{_mm256_castps_si256(by_bit(bit5, low, high))};
#else
  return hn::GatherIndex(d, table, i);
#endif
}

// As Knots(). Both knots of a pixel are gathered at once.
static void KnotsVector(const HeightModel& model, size_t n, int16_t* HWY_RESTRICT row) {
  const hn::RebindToSigned<D> d;
  const hn::Rebind<int16_t, D> d16;
  HWY_ALIGN int32_t knots[HeightModel::kKnots + 15];
  for (int i = 0; i + 1 < HeightModel::kKnots; ++i)
    knots[i] = static_cast<int32_t>(static_cast<uint16_t>(model.knots[i]) |
                                    static_cast<uint32_t>(static_cast<uint16_t>(model.knots[i + 1])) << 16);
  for (size_t x = 0; x < n; x += kN) {
    const auto at = hn::PromoteTo(d, hn::LoadU(d16, row + x));
    const auto both = KnotsAt(knots, hn::And(hn::ShiftRight<8>(at), hn::Set(d, 63)));
    const auto a = hn::ShiftRight<16>(hn::ShiftLeft<16>(both)), b = hn::ShiftRight<16>(both);
    const auto between = hn::ShiftRight<8>(hn::Mul(hn::Sub(b, a), hn::And(at, hn::Set(d, 255))));
    hn::StoreU(hn::DemoteTo(d16, hn::Add(a, between)), d16, row + x);
  }
}

#include "common/codec/dense/vectors/contexts-inl.h"
#include "common/codec/dense/vectors/guided-inl.h"
#include "common/codec/dense/vectors/surface-inl.h"

static void SampleShares(const float (*features)[kFeatures], const float* terms, size_t n, float least, bool squared,
                         float* shares) {
  const hn::FixedTag<float, 4> d;
  const auto t0 = hn::LoadU(d, terms), t1 = hn::LoadU(d, terms + 4), t2 = hn::LoadU(d, terms + 8),
             t3 = hn::LoadU(d, terms + 12);
  const auto parts = [&](const float* f) HWY_ATTR {
    auto sum = hn::Mul(t0, hn::LoadU(d, f));
    sum = hn::Add(sum, hn::Mul(t1, hn::LoadU(d, f + 4)));
    sum = hn::Add(sum, hn::Mul(t2, hn::LoadU(d, f + 8)));
    return hn::Add(sum, hn::Mul(t3, hn::LoadU(d, f + 12)));
  };
  const auto pairs = [&](auto a, auto b) HWY_ATTR { return hn::Add(hn::ConcatEven(d, b, a), hn::ConcatOdd(d, b, a)); };
  for (size_t s = 0; s < n; s += 4) {
    const auto off =
        pairs(pairs(parts(features[s]), parts(features[s + 1])), pairs(parts(features[s + 2]), parts(features[s + 3])));
    const auto size = hn::Add(hn::Set(d, least), hn::Abs(off));
    hn::StoreU(hn::Div(hn::Set(d, 1.0f), squared ? hn::Mul(size, size) : size), d, shares + s);
  }
}

static const Kernels* Set() {
  static constexpr Kernels all{CoveredBits,
                               CoverBytes,
                               CutWide,
                               CutShort,
                               PackBytes,
                               PackShorts,
                               PackWide,
                               UnpackBytes,
                               UnpackWideVector,
                               KeepBytes,
                               FillValues,
                               Within,
                               LargestLessOne,
                               DepthResiduals,
                               DepthRowsVector,
                               PlaneResidualsVector,
                               PlaneTermsVector,
                               PlaneKinds,
                               PlaneContextsVector,
                               PairedContexts,
                               JoinBytes,
                               OtherNormals,
                               TurnNormals,
                               TurnNormalsBack,
                               Divide,
                               UnfoldBytes,
                               UnfoldWide,
                               MedianResiduals,
                               PairedResiduals,
                               PairedResidualsWide,
                               MedianValues,
                               PairedSums,
                               Flatness,
                               ShortGeometry,
                               ShortHeights,
                               KnotsVector,
                               ShortActivity,
                               NormalEquations,
                               SampleShares,
                               Slots,
                               PutSymbols,
                               GetSymbols};
  return &all;
}

#endif

}  // namespace telesplat::codec::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::codec::detail {

HWY_EXPORT(Set);

const Kernels& kernels() { return *HWY_DYNAMIC_DISPATCH(Set)(); }
std::vector<int64_t> kernel_targets() { return hwy::SupportedAndGeneratedTargets(); }

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
