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
                               MedianResiduals,
                               GuidedResiduals<GuidedSums>,
                               GuidedResidualsWide<GuidedSums>,
                               MedianValues,
                               GuidedSums,
                               AddResiduals,
                               Flatness,
                               Geometry,
                               Heights,
                               Knots,
                               Activity,
                               NormalEquations,
                               SampleShares,
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

// Both halves of the entries at `index`: gathered at once, since a gather takes as long as it has elements.
HWY_INLINE void GatherEntries(const EncodeEntry* tables, V index, V& reciprocal, V& packed) {
#if HWY_TARGET <= HWY_AVX3
  const __m512i low = _mm512_i32gather_epi64(_mm512_castsi512_si256(index.raw), tables, 8),
                high = _mm512_i32gather_epi64(_mm512_extracti64x4_epi64(index.raw, 1), tables, 8);
  const __m512i even = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
  reciprocal = V{_mm512_permutex2var_epi32(low, even, high)};
  packed = V{_mm512_permutex2var_epi32(low, _mm512_add_epi32(even, _mm512_set1_epi32(1)), high)};
#elif HWY_TARGET == HWY_AVX2
  const auto* const words = reinterpret_cast<const long long*>(tables);
  const __m256 low = _mm256_castsi256_ps(_mm256_i32gather_epi64(words, _mm256_castsi256_si128(index.raw), 8)),
               high = _mm256_castsi256_ps(_mm256_i32gather_epi64(words, _mm256_extracti128_si256(index.raw, 1), 8));
  reciprocal = V{_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88)), 0xD8)};
  packed = V{_mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0xDD)), 0xD8)};
#else
  const hn::RebindToSigned<D> s;
  const auto* const words = reinterpret_cast<const uint32_t*>(tables);
  const auto at = hn::BitCast(s, hn::Add(index, index));
  reciprocal = hn::GatherIndex(kD, words, at), packed = hn::GatherIndex(kD, words + 1, at);
#endif
}

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
  for (size_t i = 0; i < kVectors; ++i) {
    const size_t left = n > i * kN ? n - i * kN : 0;
    const M valid = hn::FirstN(kD, left);
    const V contexts = hn::IfThenElseZero(valid, Load8(row.contexts + begin + i * kN));
    V reciprocal, packed;
    GatherEntries(tables, hn::Add(tokens[i], hn::ShiftLeft<8>(contexts)), reciprocal, packed);
    const V complement = hn::And(hn::ShiftRight<13>(packed), hn::Set(kD, 0xFFFu));
    const V limit =
        hn::Sub(hn::ShiftLeft<kStateBits - kFrequencyBits>(hn::Sub(hn::Set(kD, kFrequencyOne), complement)), one);
    V y = Spill(x[i], hn::And(valid, Exceeds(x[i], limit)), out);
    const V quotient = hn::Shr(High32(y, reciprocal), hn::ShiftRight<25>(packed));
    y = hn::Add(hn::Add(y, hn::And(packed, hn::Set(kD, 0x1FFFu))), hn::Mul(quotient, complement));
    x[i] = hn::IfThenElse(valid, y, x[i]);
  }
  return out;
}

template <bool kWide, size_t kSets>
HWY_INLINE uint8_t* PutAll(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  V x[kSets][kVectors];
  for (size_t i = 0; i < kSets * kVectors; ++i) x[i / kVectors][i % kVectors] = hn::LoadU(kD, states + i * kN);
  size_t begin = row.count / kLanes * kLanes;
  const auto put = [&](size_t n) HWY_ATTR {
    if (kSets > 1 && begin / kLanes % 2 != 0)
      out = PutGroup<kWide>(row, begin, tables, x[kSets - 1], n, out);
    else
      out = PutGroup<kWide>(row, begin, tables, x[0], n, out);
  };
  if (begin != row.count) put(row.count - begin);
  if (kSets > 1 && begin / kLanes % 2 != 0) begin -= kLanes, put(kLanes);
  while (begin != 0) {
    begin -= kSets * kLanes;
    for (size_t set = kSets; set-- > 0;) out = PutGroup<kWide>(row, begin + set * kLanes, tables, x[set], kLanes, out);
  }
  for (size_t i = 0; i < kSets * kVectors; ++i) hn::StoreU(x[i / kVectors][i % kVectors], kD, states + i * kN);
  return out;
}

template <size_t kSets>
HWY_INLINE uint8_t* PutSets(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  return row.wide != nullptr ? PutAll<true, kSets>(row, tables, states, out)
                             : PutAll<false, kSets>(row, tables, states, out);
}

static uint8_t* PutSymbols(const SymbolRow& row, const EncodeEntry* tables, uint32_t* states, uint8_t* out) {
  return row.states > kLanes ? PutSets<2>(row, tables, states, out) : PutSets<1>(row, tables, states, out);
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

// n symbols, at most kLanes; there must be 3 kLanes words before `end`. Writes kLanes of them.
template <bool kWhole, bool kWide>
HWY_INLINE const uint8_t* GetGroup(const DecodedRow& row, size_t begin, size_t n, const uint32_t* tables,
                                   V (&x)[kVectors], const uint8_t* end) {
  const hn::RebindToSigned<D> s;
  const auto one = hn::Set(kD, 1u), first = hn::Set(kD, row.first), fifteen = hn::Set(kD, 15u);
  V kept[kVectors], bits[kVectors];
  auto widest = hn::Zero(kD);
  for (size_t i = kVectors; i-- > 0;) {
    const M valid = hn::FirstN(kD, kWhole ? kN : n > i * kN ? n - i * kN : 0);
    V contexts = Load8(row.contexts + begin + i * kN);
    if constexpr (!kWhole) contexts = hn::IfThenElseZero(valid, contexts);
    const V index = hn::Or(hn::ShiftLeft<kFrequencyBits>(contexts), hn::And(x[i], hn::Set(kD, kFrequencyOne - 1)));
    const V entry = hn::GatherIndex(kD, tables, hn::BitCast(s, index));
    const V token = hn::ShiftRight<24>(entry);
    hn::StoreU(hn::TruncateTo(kD8, token), kD8, row.tokens + begin + i * kN);
    const V frequency = hn::Add(hn::And(hn::ShiftRight<12>(entry), hn::Set(kD, 0xFFFu)), one);
    const V next =
        hn::Add(hn::Mul(frequency, hn::ShiftRight<kFrequencyBits>(x[i])), hn::And(entry, hn::Set(kD, 0xFFFu)));
    x[i] = Refill(kWhole ? next : hn::IfThenElse(valid, next, x[i]), end);
    V over = hn::Sub(hn::Max(token, first), first);
    if constexpr (!kWhole) over = hn::IfThenElseZero(valid, over);
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

template <bool kWide, size_t kSets>
HWY_INLINE const uint8_t* GetAll(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  V x[kSets][kVectors];
  for (size_t i = 0; i < kSets * kVectors; ++i) x[i / kVectors][i % kVectors] = hn::LoadU(kD, states + i * kN);
  constexpr size_t kMostBytes = 6 * kLanes;  // of a group
  // Words that are none are found afterwards, where what is read is memory at least.
  const uint8_t* const lowest = row.readable != nullptr ? row.readable : begin;
  const auto enough = [&](size_t groups) {
    return end >= begin && static_cast<size_t>(end - lowest) >= groups * kMostBytes;
  };
  size_t at = 0;
  for (; at + kSets * kLanes <= row.count && enough(kSets); at += kSets * kLanes)
    for (size_t set = 0; set < kSets; ++set)
      end = GetGroup<true, kWide>(row, at + set * kLanes, kLanes, tables, x[set], end);
  size_t set = 0;  // of the next group
  if (kSets > 1 && at + kLanes <= row.count && enough(1)) {
    end = GetGroup<true, kWide>(row, at, kLanes, tables, x[0], end);
    at += kLanes, set = 1;
  }
  if (at < row.count && row.count - at < kLanes && enough(1)) {
    const size_t n = row.count - at;
    HWY_ALIGN uint8_t contexts[kLanes] = {}, tokens[kLanes], narrow[kLanes];
    HWY_ALIGN uint32_t wide[kLanes];
    std::memcpy(contexts, row.contexts + at, n);
    const DecodedRow rest{contexts, tokens, wide, narrow, n, row.first};
    if (set == 0)
      end = GetGroup<false, kWide>(rest, 0, n, tables, x[0], end);
    else
      end = GetGroup<false, kWide>(rest, 0, n, tables, x[kSets - 1], end);
    std::memcpy(row.tokens + at, tokens, n);
    if constexpr (kWide)
      std::memcpy(row.wide + at, wide, 4 * n);
    else
      std::memcpy(row.narrow + at, narrow, n);
    at = row.count;
  }
  for (size_t i = 0; i < kSets * kVectors; ++i) hn::StoreU(x[i / kVectors][i % kVectors], kD, states + i * kN);
  if (end < begin) return nullptr;
  for (; at < row.count && end != nullptr; at += kLanes)
    end = PlainGetGroup(row, at, row.count - at < kLanes ? row.count - at : kLanes, tables,
                        StatesOf(states, row.states, at), begin, end);
  return end;
}

template <size_t kSets>
HWY_INLINE const uint8_t* GetSets(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                  const uint8_t* end) {
  return row.wide != nullptr ? GetAll<true, kSets>(row, tables, states, begin, end)
                             : GetAll<false, kSets>(row, tables, states, begin, end);
}

static const uint8_t* GetSymbols(const DecodedRow& row, const uint32_t* tables, uint32_t* states, const uint8_t* begin,
                                 const uint8_t* end) {
  return row.states > kLanes ? GetSets<2>(row, tables, states, begin, end)
                             : GetSets<1>(row, tables, states, begin, end);
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
  const hn::CappedTag<float, 16> d;
  for (int i = 0; i < kFeatures; i += 8)
    for (int j = 0; j <= i + 7; j += static_cast<int>(hn::Lanes(d))) {
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
}

// table[i] of each i below 64.
HWY_INLINE hn::VFromD<hn::RebindToSigned<D> > KnotsAt(const int32_t* table, hn::VFromD<hn::RebindToSigned<D> > i) {
  const hn::RebindToSigned<D> d;
#if HWY_TARGET <= HWY_AVX3  // tables in registers: gathers take longer
  const auto part = [&](int k) HWY_ATTR { return hn::Load(d, table + 16 * k).raw; };
  const __m512i low = _mm512_permutex2var_epi32(part(0), i.raw, part(1)),
                high = _mm512_permutex2var_epi32(part(2), i.raw, part(3));
  const __mmask16 upper = _mm512_test_epi32_mask(i.raw, _mm512_set1_epi32(32));
  return hn::VFromD<decltype(d)>{_mm512_mask_mov_epi32(low, upper, high)};
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

#if HWY_TARGET <= HWY_AVX2

// Pairs of guided prediction's terms whose products are added at once; the last one is what is to the left.
constexpr int kTermPairs[8][2] = {{1, 2}, {3, 4}, {5, 6}, {7, 8}, {9, 10}, {11, 12}, {13, kFarAbove}, {0, kFarLeft}};
using D16 = hn::CappedTag<int16_t, 32>;
using D32 = hn::Repartition<int32_t, D16>;
using V16 = hn::VFromD<D16>;
using V32 = hn::VFromD<D32>;
constexpr D16 kD16s;
constexpr D32 kD32s;

HWY_INLINE V32 PairProducts(V16 pairs, V32 weights) {
#if HWY_TARGET <= HWY_AVX3
  return V32{_mm512_madd_epi16(pairs.raw, weights.raw)};
#else
  return V32{_mm256_madd_epi16(pairs.raw, weights.raw)};
#endif
}

// Of each block of eight pixels the first and the last four -> pixels in their order.
HWY_INLINE void StorePairs(V32 low, V32 high, int32_t* sums) {
#if HWY_TARGET <= HWY_AVX3
  const __m512i first = _mm512_set_epi64(11, 10, 3, 2, 9, 8, 1, 0), last = _mm512_set_epi64(15, 14, 7, 6, 13, 12, 5, 4);
  hn::StoreU(V32{_mm512_permutex2var_epi64(low.raw, first, high.raw)}, kD32s, sums);
  hn::StoreU(V32{_mm512_permutex2var_epi64(low.raw, last, high.raw)}, kD32s, sums + 16);
#else
  hn::StoreU(V32{_mm256_permute2x128_si256(low.raw, high.raw, 0x20)}, kD32s, sums);
  hn::StoreU(V32{_mm256_permute2x128_si256(low.raw, high.raw, 0x31)}, kD32s, sums + 8);
#endif
}

HWY_INLINE int32_t PairOf(const int16_t* weights, int pair) {
  return static_cast<int32_t>(static_cast<uint16_t>(weights[kTermPairs[pair][0]]) |
                              static_cast<uint32_t>(static_cast<uint16_t>(weights[kTermPairs[pair][1]])) << 16);
}

// The weights of each pixel's flatness: at[i] of the eight at `weights`.
HWY_INLINE V32 ByFlatness(const int32_t* weights, V32 at) {
#if HWY_TARGET <= HWY_AVX3
  return V32{_mm512_permutexvar_epi32(
      at.raw, _mm512_broadcast_i64x4(_mm256_load_si256(reinterpret_cast<const __m256i*>(weights))))};
#else
  return V32{_mm256_permutevar8x32_epi32(_mm256_load_si256(reinterpret_cast<const __m256i*>(weights)), at.raw)};
#endif
}

static void PairedSumsByFlatness(const GuidedRows& rows, size_t n, int32_t* HWY_RESTRICT sums, bool with_left) {
  const int16_t *const up = rows.above, *const g0 = rows.guide[0], *const g1 = rows.guide[1], *const g2 = rows.guide[2];
  const int16_t* const residual = rows.residual != nullptr ? rows.residual : up;
  const int16_t* const terms[kGuidedTerms] = {rows.own - 1, up,       up - 1,       up + 1,     g0 - 1, g0,
                                              g0 + 1,       g1 - 1,   g1,           g1 + 1,     g2 - 1, g2,
                                              g2 + 1,       residual, rows.own - 2, rows.above2};
  HWY_ALIGN int32_t weights[8][kFlatnesses];
  for (int pair = 0; pair < 8; ++pair)
    for (int k = 0; k < kFlatnesses; ++k) {
      weights[pair][k] = PairOf(rows.weights[k], pair);
      if (pair == 6 && rows.residual == nullptr) weights[pair][k] &= ~0xFFFF;
    }
  const V32 constant = hn::Set(kD32s, rows.constant);
  const hn::Rebind<uint8_t, D16> bytes;
  const hn::RebindToUnsigned<D16> words;
  for (size_t x = 0; x < n; x += hn::Lanes(kD16s)) {
    const V16 flat = hn::BitCast(kD16s, hn::PromoteTo(words, hn::LoadU(bytes, rows.flatness + x)));
    const V32 flat_low = hn::BitCast(kD32s, hn::InterleaveLower(kD16s, flat, hn::Zero(kD16s))),
              flat_high = hn::BitCast(kD32s, hn::InterleaveUpper(kD16s, flat, hn::Zero(kD16s)));
    V32 low = constant, high = constant;
    for (int pair = 0; pair < (with_left ? 8 : 7); ++pair) {
      const V16 a = hn::LoadU(kD16s, terms[kTermPairs[pair][0]] + x),
                b = hn::LoadU(kD16s, terms[kTermPairs[pair][1]] + x);
      low = hn::Add(low, PairProducts(hn::InterleaveLower(kD16s, a, b), ByFlatness(weights[pair], flat_low)));
      high = hn::Add(high, PairProducts(hn::InterleaveUpper(kD16s, a, b), ByFlatness(weights[pair], flat_high)));
    }
    StorePairs(low, high, sums + x);
  }
}

// As GuidedSums(): products of 16 bits, two at a time, which halves their number.
static void PairedSums(const GuidedRows& rows, size_t n, int32_t* HWY_RESTRICT sums, bool with_left) {
  if (rows.flatness != nullptr) return PairedSumsByFlatness(rows, n, sums, with_left);
  const int16_t *const up = rows.above, *const g0 = rows.guide[0], *const g1 = rows.guide[1], *const g2 = rows.guide[2];
  const int16_t* const terms[12] = {up, up - 1, up + 1, g0 - 1, g0, g0 + 1, g1 - 1, g1, g1 + 1, g2 - 1, g2, g2 + 1};
  V32 weights[7];
  for (int pair = 0; pair < 7; ++pair) weights[pair] = hn::Set(kD32s, PairOf(rows.weights[0], pair));
  const V32 constant = hn::Set(kD32s, rows.constant);
  for (size_t x = 0; x < n; x += hn::Lanes(kD16s)) {
    V32 low = constant, high = constant;
    const auto add = [&](V16 a, V16 b, V32 w) HWY_ATTR {
      low = hn::Add(low, PairProducts(hn::InterleaveLower(kD16s, a, b), w));
      high = hn::Add(high, PairProducts(hn::InterleaveUpper(kD16s, a, b), w));
    };
    for (int i = 0; i < 6; ++i)
      add(hn::LoadU(kD16s, terms[2 * i] + x), hn::LoadU(kD16s, terms[2 * i + 1] + x), weights[i]);
    if (rows.residual != nullptr) add(hn::LoadU(kD16s, rows.residual + x), hn::Zero(kD16s), weights[6]);
    StorePairs(low, high, sums + x);
  }
}

#else
constexpr SumsOf PairedSums = GuidedSums;
#endif

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
                               KeepBytes,
                               FillValues,
                               Within,
                               LargestLessOne,
                               DepthResiduals,
                               DepthRowsVector,
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
                               MedianResiduals,
                               GuidedResiduals<PairedSums>,
                               GuidedResidualsWide<PairedSums>,
                               MedianValues,
                               PairedSums,
                               AddResiduals,
                               Flatness,
                               Geometry,
                               Heights,
                               KnotsVector,
                               Activity,
                               NormalEquations,
                               SampleShares,
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

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
