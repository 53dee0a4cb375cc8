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

static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  for (int i = 0; i < kFeatures; ++i)
    for (int j = 0; j <= i; ++j) {
      float sum = 0;
      for (size_t s = 0; s < n; ++s) sum += features[s][i] * weights[s] * features[s][j];
      sums[i][j] = sum;
    }
}

static const Kernels* Set() {
  static constexpr Kernels all{CoveredBits,         DepthResiduals,  DepthRows,      PlaneResiduals,  PlaneTerms,
                               PlaneSizes,          Contexts,        OtherNormals,   MedianResiduals, GuidedResiduals,
                               GuidedResidualsWide, GuidedSums,      Geometry,       Heights,         Activity,
                               NormalEquations,     PlainPutSymbols, PlainGetSymbols};
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

// Writes the lower halves of the states that `full` names, and shifts them out.
HWY_INLINE V Spill(V x, M full, uint8_t*& out) {
  const auto words = hn::TruncateTo(kD16, Gathered(hn::And(x, hn::Set(kD, 0xFFFFu)), full));
  hn::StoreU(words, kD16, reinterpret_cast<uint16_t*>(out));
  out += 2 * hn::CountTrue(kD, full);
  return hn::IfThenElse(full, hn::ShiftRight<16>(x), x);
}

HWY_INLINE V High32(V a, V b) {
  const hn::RepartitionToWide<D> wide;
  const auto down = [&](V v) HWY_ATTR { return hn::BitCast(kD, hn::ShiftRight<32>(hn::BitCast(wide, v))); };
  const auto even = hn::MulEven(a, b), odd = hn::MulEven(down(a), down(b));
  return hn::OddEven(hn::BitCast(kD, odd), hn::BitCast(kD, hn::ShiftRight<32>(even)));
}

HWY_INLINE M Exceeds(V a, V b) {  // both below 2^31
  const hn::RebindToSigned<D> s;
  return hn::RebindMask(kD, hn::Gt(hn::BitCast(s, a), hn::BitCast(s, b)));
}

HWY_INLINE V Load8(const uint8_t* p) { return hn::PromoteTo(kD, hn::LoadU(kD8, p)); }

template <bool kWide>
HWY_INLINE V LoadZ(const SymbolRow& row, size_t at) {
  if constexpr (kWide) return hn::LoadU(kD, row.wide + at);
  return Load8(row.narrow + at);
}

template <bool kWide>
HWY_INLINE uint8_t* PutGroup(const SymbolRow& row, size_t begin, const EncodeEntry* tables, V (&x)[kVectors], size_t n,
                             uint8_t* out) {
  const auto one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V tokens[kVectors], bits[kVectors], z[kVectors];
  auto widest = hn::Zero(kD);
  for (size_t i = 0; i < kVectors; ++i) {
    const M valid = hn::FirstN(kD, n > i * kN ? n - i * kN : 0);
    tokens[i] = hn::IfThenElseZero(valid, Load8(row.tokens + begin + i * kN));
    bits[i] = hn::ShiftRight<3>(hn::Sub(hn::Max(tokens[i], first), first));
    z[i] = hn::Add(LoadZ<kWide>(row, begin + i * kN), hn::Set(kD, 8u));
    widest = hn::Max(widest, bits[i]);
    const V low = kWide ? hn::Min(bits[i], fifteen) : bits[i];
    const V limit = hn::Sub(hn::Shl(one, hn::Sub(hn::Set(kD, 31u), low)), one);
    x[i] = Spill(x[i], hn::And(valid, Exceeds(x[i], limit)), out);
    x[i] = hn::Or(hn::Shl(x[i], low), hn::And(z[i], hn::Sub(hn::Shl(one, low), one)));
  }
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen)))
    for (size_t i = 0; i < kVectors; ++i) {
      const V high = hn::Sub(hn::Max(bits[i], fifteen), fifteen);
      const V limit = hn::Sub(hn::Shl(one, hn::Sub(hn::Set(kD, 31u), high)), one);
      x[i] = Spill(x[i], Exceeds(x[i], limit), out);
      x[i] = hn::Or(hn::Shl(x[i], high), hn::And(hn::ShiftRight<15>(z[i]), hn::Sub(hn::Shl(one, high), one)));
    }
  const hn::RebindToSigned<D> s;
  const auto* const words = reinterpret_cast<const uint32_t*>(tables);
  for (size_t i = 0; i < kVectors; ++i) {
    const size_t left = n > i * kN ? n - i * kN : 0;
    const M valid = hn::FirstN(kD, left);
    const V contexts = hn::IfThenElseZero(valid, Load8(row.contexts + begin + i * kN));
    const V index = hn::Add(hn::Add(tokens[i], tokens[i]), hn::ShiftLeft<9>(contexts));
    const V reciprocal = hn::GatherIndex(kD, words, hn::BitCast(s, index)),
            packed = hn::GatherIndex(kD, words + 1, hn::BitCast(s, index));
    const V complement = hn::And(hn::ShiftRight<13>(packed), hn::Set(kD, 0xFFFu));
    const V limit = hn::Sub(hn::ShiftLeft<19>(hn::Sub(hn::Set(kD, kFrequencyOne), complement)), one);
    V y = Spill(x[i], hn::And(valid, Exceeds(x[i], limit)), out);
    const V quotient = hn::Shr(High32(y, reciprocal), hn::ShiftRight<25>(packed));
    y = hn::Add(hn::Add(y, hn::And(packed, hn::Set(kD, 0x1FFFu))), hn::Mul(quotient, complement));
    x[i] = hn::IfThenElse(valid, y, x[i]);
  }
  return out;
}

template <bool kWide>
HWY_INLINE uint8_t* PutAll(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  V x[kVectors];
  for (size_t i = 0; i < kVectors; ++i) x[i] = hn::LoadU(kD, states + i * kN);
  size_t begin = row.count / kLanes * kLanes;
  if (begin != row.count) out = PutGroup<kWide>(row, begin, tables, x, row.count - begin, out);
  while (begin != 0) {
    begin -= kLanes;
    out = PutGroup<kWide>(row, begin, tables, x, kLanes, out);
  }
  for (size_t i = 0; i < kVectors; ++i) hn::StoreU(x[i], kD, states + i * kN);
  return out;
}

static uint8_t* PutSymbols(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  return row.wide != nullptr ? PutAll<true>(row, tables, states, out) : PutAll<false>(row, tables, states, out);
}

// Puts the first elements of v to where `to` is set, in order.
HWY_INLINE V Spread(V v, M to) {
#if HWY_TARGET <= HWY_AVX3
  return V{_mm512_maskz_expand_epi32(to.raw, v.raw)};
#else
  uint8_t bits[8] = {};
  hn::StoreMaskBits(kD, to, bits);
  return hn::TableLookupLanes(v, hn::SetTableIndices(kD, kRanks.of[bits[0]]));
#endif
}

// Fills up the states that are below kStateLow with the words before `end`.
HWY_INLINE V Refill(V x, const uint8_t*& end) {
  const M low = Exceeds(hn::Set(kD, kStateLow), x);
  end -= 2 * hn::CountTrue(kD, low);
  const V words = hn::PromoteTo(kD, hn::LoadU(kD16, reinterpret_cast<const uint16_t*>(end)));
  return hn::IfThenElse(low, hn::Or(hn::ShiftLeft<16>(x), Spread(words, low)), x);
}

// kLanes symbols; there must be 3 kLanes words before `end`.
template <bool kWide>
HWY_INLINE const uint8_t* GetGroup(const DecodedRow& row, size_t begin, const uint32_t* tables, V (&x)[kVectors],
                                   const uint8_t* end) {
  const hn::RebindToSigned<D> s;
  const auto one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V kept[kVectors], bits[kVectors];
  auto widest = hn::Zero(kD);
  for (size_t i = kVectors; i-- > 0;) {
    const V index =
        hn::Or(hn::ShiftLeft<12>(Load8(row.contexts + begin + i * kN)), hn::And(x[i], hn::Set(kD, kFrequencyOne - 1)));
    const V entry = hn::GatherIndex(kD, tables, hn::BitCast(s, index));
    const V token = hn::ShiftRight<24>(entry);
    hn::StoreU(hn::TruncateTo(kD8, token), kD8, row.tokens + begin + i * kN);
    const V frequency = hn::Add(hn::And(hn::ShiftRight<12>(entry), hn::Set(kD, 0xFFFu)), one);
    x[i] = hn::Add(hn::Mul(frequency, hn::ShiftRight<12>(x[i])), hn::And(entry, hn::Set(kD, 0xFFFu)));
    x[i] = Refill(x[i], end);
    const V over = hn::Sub(hn::Max(token, first), first);
    bits[i] = hn::ShiftRight<3>(over);
    kept[i] = hn::Shl(hn::Add(hn::And(over, hn::Set(kD, 7u)), hn::Set(kD, 8u)), bits[i]);
    widest = hn::Max(widest, bits[i]);
  }
  if (kWide && !hn::AllFalse(kD, hn::Gt(widest, fifteen)))
    for (size_t i = kVectors; i-- > 0;) {
      const V high = hn::Sub(hn::Max(bits[i], fifteen), fifteen);
      kept[i] = hn::Add(kept[i], hn::ShiftLeft<15>(hn::And(x[i], hn::Sub(hn::Shl(one, high), one))));
      x[i] = Refill(hn::Shr(x[i], high), end);
    }
  for (size_t i = kVectors; i-- > 0;) {
    const V low = hn::Min(bits[i], fifteen);
    const V z = hn::Sub(hn::Add(kept[i], hn::And(x[i], hn::Sub(hn::Shl(one, low), one))), hn::Set(kD, 8u));
    x[i] = Refill(hn::Shr(x[i], low), end);
    if constexpr (kWide)
      hn::StoreU(z, kD, row.wide + begin + i * kN);
    else
      hn::StoreU(hn::TruncateTo(kD8, z), kD8, row.narrow + begin + i * kN);
  }
  return end;
}

template <bool kWide>
HWY_INLINE const uint8_t* GetAll(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  V x[kVectors];
  for (size_t i = 0; i < kVectors; ++i) x[i] = hn::LoadU(kD, states + i * kN);
  size_t at = 0;
  for (; at + kLanes <= row.count && static_cast<size_t>(end - begin) >= 6 * kLanes; at += kLanes)
    end = GetGroup<kWide>(row, at, tables, x, end);
  for (size_t i = 0; i < kVectors; ++i) hn::StoreU(x[i], kD, states + i * kN);
  for (; at < row.count && end != nullptr; at += kLanes)
    end = PlainGetGroup(row, at, row.count - at < kLanes ? row.count - at : kLanes, tables, states, begin, end);
  return end;
}

static const uint8_t* GetSymbols(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  return row.wide != nullptr ? GetAll<true>(row, tables, states, begin, end)
                             : GetAll<false>(row, tables, states, begin, end);
}

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
static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  const hn::CappedTag<float, 8> d;
  for (int i = 0; i < kFeatures; i += 8)
    for (int j = 0; j <= i + 7; j += static_cast<int>(hn::Lanes(d))) {
      auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
      for (size_t s = 0; s < n; ++s) {
        const float *const f = features[s] + i, w = weights[s];
        const auto v = hn::LoadU(d, features[s] + j);
        const auto add = [&](auto& sum, int k) HWY_ATTR { sum = hn::Add(sum, hn::Mul(hn::Set(d, f[k] * w), v)); };
        add(s0, 0), add(s1, 1), add(s2, 2), add(s3, 3), add(s4, 4), add(s5, 5), add(s6, 6), add(s7, 7);
      }
      hn::StoreU(s0, d, sums[i] + j), hn::StoreU(s1, d, sums[i + 1] + j), hn::StoreU(s2, d, sums[i + 2] + j);
      hn::StoreU(s3, d, sums[i + 3] + j), hn::StoreU(s4, d, sums[i + 4] + j), hn::StoreU(s5, d, sums[i + 5] + j);
      hn::StoreU(s6, d, sums[i + 6] + j), hn::StoreU(s7, d, sums[i + 7] + j);
    }
}

static const Kernels* Set() {
  static constexpr Kernels all{CoveredBits,         DepthResiduals, DepthRowsVector, PlaneResiduals,  PlaneTerms,
                               PlaneSizes,          Contexts,       OtherNormals,    MedianResiduals, GuidedResiduals,
                               GuidedResidualsWide, GuidedSums,     Geometry,        Heights,         Activity,
                               NormalEquations,     PutSymbols,     GetSymbols};
  return &all;
}

#endif

}  // namespace telesplat::codec::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::codec::detail {

HWY_EXPORT(Set);

const Kernels& kernels() { return *HWY_DYNAMIC_DISPATCH(Set)(); }

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
