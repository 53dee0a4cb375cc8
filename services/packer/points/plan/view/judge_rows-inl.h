// Included once per target, by judge_rows.cpp.
#if defined(TELESPLAT_PACKER_JUDGE_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_PACKER_JUDGE_ROWS_INL_H_
#undef TELESPLAT_PACKER_JUDGE_ROWS_INL_H_
#else
#define TELESPLAT_PACKER_JUDGE_ROWS_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstring>
#include <limits>

#include "services/packer/points/plan/view/judge_rows.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::packer::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F32 = hn::ScalableTag<float>;
using I32 = hn::RebindToSigned<F32>;
using U32 = hn::RebindToUnsigned<F32>;

// Depth codes (2^14 per octave). A step is a depth difference of more than kStep, and more than twice the difference
// beyond it on one side: so a surface seen at a grazing angle has no step, and a thin object has two.
constexpr int32_t kStep = 96;
// Limits for differences of normals (sum over both octahedral coordinates, about one per degree) and of colours
// (largest channel).
constexpr int32_t kFarNormals = 40, kStrongNormals = 20, kWeakNormals = 3;
constexpr float kEdgeCosine = 0.77f;  // 40 degrees
constexpr int32_t kStrongColours = 48, kWeakColours = 5;

void SplitRow(const uint64_t* keys, int first, int last, const BiasTable& bias, const PixelRow& out) {
  const I32 di;
  const U32 du;
  const int lanes = static_cast<int>(hn::Lanes(du));
  for (int x = first; x < last; x += lanes) {
    hn::Vec<U32> low, high;
    hn::LoadInterleaved2(du, reinterpret_cast<const uint32_t*>(keys + x), low, high);
    const auto entry = hn::BitCast(di, hn::And(hn::ShiftRight<splat::kKeyRingBit - 32>(high), hn::Set(du, 31u)));
    const auto biased = hn::BitCast(di, hn::And(hn::ShiftRight<splat::kKeyDepthBit - 32>(high), hn::Set(du, 0x3ffffu)));
    const auto code = hn::Max(hn::Sub(biased, hn::GatherIndex(di, bias.data(), entry)), hn::Zero(di));
    const auto nothing = hn::RebindMask(di, hn::Eq(high, hn::Set(du, 0xffffffffu)));
    hn::StoreU(hn::IfThenElse(nothing, hn::Set(di, kNoCode), code), di, out.code + x);
    const auto shown = hn::RebindMask(du, hn::Not(nothing));
    hn::StoreU(hn::IfThenElseZero(shown, low), du, out.attributes + x);
    hn::StoreU(hn::IfThenElseZero(shown, hn::And(high, hn::Set(du, 255u))), du, out.normal_high + x);
  }
}

struct NormalLanes {
  hn::Vec<F32> x, y, z;
};

// Decodes normals as image::octahedral16 does.
HWY_INLINE NormalLanes Normal(hn::Vec<U32> low, hn::Vec<U32> high) {
  const F32 d;
  const auto whole = hn::Set(d, 127.0f);
  const auto at = [&](hn::Vec<U32> c)
                      HWY_ATTR { return hn::Min(hn::Sub(hn::ConvertTo(d, hn::BitCast(I32(), c)), whole), whole); };
  const auto x = at(low), y = at(high);
  const auto z = hn::Sub(hn::Sub(whole, hn::Abs(x)), hn::Abs(y));
  const auto fold = hn::Max(hn::Neg(z), hn::Zero(d));
  return {hn::Sub(x, hn::CopySign(fold, x)), hn::Sub(y, hn::CopySign(fold, y)), z};
}

HWY_INLINE hn::Vec<F32> Dot(const NormalLanes& a, const NormalLanes& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

// Returns the lanes whose normals are more than 40 degrees apart.
HWY_INLINE hn::Mask<I32> Turned(const NormalLanes& a, const NormalLanes& b) {
  const F32 d;
  const auto towards = Dot(a, b);
  const auto limit = hn::Mul(hn::Set(d, kEdgeCosine * kEdgeCosine), hn::Mul(Dot(a, a), Dot(b, b)));
  const auto small = hn::Or(hn::Lt(towards, hn::Zero(d)), hn::Lt(hn::Mul(towards, towards), limit));
  return hn::RebindMask(I32(), small);
}

// Returns |a - b| of one byte.
template <int kShift>
HWY_INLINE hn::Vec<I32> Apart(hn::Vec<U32> a, hn::Vec<U32> b) {
  const auto byte = [](hn::Vec<U32> v) HWY_ATTR {
    return hn::BitCast(I32(), hn::And(hn::ShiftRight<kShift>(v), hn::Set(U32(), 255u)));
  };
  return hn::Abs(hn::Sub(byte(a), byte(b)));
}

// True where there is a step between a and b, given the codes beyond them.
HWY_INLINE hn::Mask<I32> Steps(hn::Vec<I32> before, hn::Vec<I32> a, hn::Vec<I32> b, hn::Vec<I32> after) {
  const I32 di;
  const auto none = hn::Set(di, kNoCode);
  const auto step = hn::Abs(hn::Sub(a, b));
  const auto left = hn::IfThenZeroElse(hn::Eq(before, none), hn::Abs(hn::Sub(a, before))),
             right = hn::IfThenZeroElse(hn::Eq(after, none), hn::Abs(hn::Sub(after, b)));
  const auto slope = hn::Min(left, right);
  const auto sharp = hn::And(hn::Gt(step, hn::Set(di, kStep)), hn::Gt(step, hn::Add(slope, slope)));
  return hn::Or(sharp, hn::Xor(hn::Eq(a, none), hn::Eq(b, none)));
}

void CompareRows(const NeighbourRows& rows, int first, int last, int32_t* out) {
  const int32_t *before = rows.before, *after = rows.after;
  const PixelRow a = rows.a, b = rows.b;
  const I32 di;
  const U32 du;
  const int lanes = static_cast<int>(hn::Lanes(du));
  for (int x = first; x < last; x += lanes) {
    const auto code_a = hn::LoadU(di, a.code + x), code_b = hn::LoadU(di, b.code + x);
    const auto edge = Steps(hn::LoadU(di, before + x), code_a, code_b, hn::LoadU(di, after + x));
    const auto low_a = hn::LoadU(du, a.attributes + x), low_b = hn::LoadU(du, b.attributes + x);
    const auto high_a = hn::LoadU(du, a.normal_high + x), high_b = hn::LoadU(du, b.normal_high + x);
    const auto colours = hn::Max(Apart<0>(low_a, low_b), hn::Max(Apart<8>(low_a, low_b), Apart<16>(low_a, low_b)));
    const auto normals =
        hn::Add(Apart<24>(low_a, low_b), hn::Abs(hn::Sub(hn::BitCast(di, high_a), hn::BitCast(di, high_b))));
    const auto differ = [&](int32_t by_normals, int32_t by_colours) HWY_ATTR {
      return hn::Or(hn::Gt(normals, hn::Set(di, by_normals)), hn::Gt(colours, hn::Set(di, by_colours)));
    };
    auto level = hn::IfThenElseZero(differ(kWeakNormals, kWeakColours), hn::Set(di, int32_t{kWeak}));
    level = hn::IfThenElse(differ(kStrongNormals, kStrongColours), hn::Set(di, int32_t{kStrong}), level);
    auto is_edge = edge;
    const auto far = hn::Gt(normals, hn::Set(di, kFarNormals));
    if (!hn::AllFalse(di, far)) {
      const NormalLanes n_a = Normal(hn::ShiftRight<24>(low_a), high_a),
                        n_b = Normal(hn::ShiftRight<24>(low_b), high_b);
      is_edge = hn::Or(is_edge, hn::And(far, Turned(n_a, n_b)));
    }
    level = hn::IfThenElse(is_edge, hn::Set(di, int32_t{kEdge}), level);
    const auto none = hn::And(hn::Eq(code_a, hn::Set(di, kNoCode)), hn::Eq(code_a, code_b));
    hn::StoreU(hn::IfThenZeroElse(none, level), di, out + x);
  }
}

HWY_INLINE uint64_t Bits(hn::Mask<I32> mask) {
  uint8_t bytes[8 + HWY_MAX_BYTES / 8] = {};
  hn::StoreMaskBits(I32(), mask, bytes);
  uint64_t bits;
  std::memcpy(&bits, bytes, 8);
  const size_t lanes = hn::Lanes(I32());
  return lanes >= 64 ? bits : bits & ((uint64_t{1} << lanes) - 1);
}

HWY_INLINE hn::Vec<F32> Metres(hn::Vec<I32> code, float near_m) {
  const I32 di;
  const int32_t first = std::bit_cast<int32_t>(near_m) + (1 << (splat::kDepthCodeShift - 1));
  return hn::BitCast(F32(), hn::Add(hn::ShiftLeft<splat::kDepthCodeShift>(code), hn::Set(di, first)));
}

RowBits JudgeRow64(const ContrastRow& row, float near_m, float farther, int x0) {
  const int32_t *code = row.code, *beside = row.beside, *above = row.above, *below = row.below;
  const I32 di;
  const F32 d;
  const int lanes = static_cast<int>(hn::Lanes(di));
  RowBits out;
  for (int i = 0; i < 64; i += lanes) {
    const int x = x0 + i;
    const auto c = hn::LoadU(di, code + x);
    const auto covered = hn::Ne(c, hn::Set(di, kNoCode));
    const auto point = hn::BitCast(d, hn::LoadU(U32(), row.depth_bits + x));
    const auto own = hn::Le(point, hn::Mul(Metres(hn::IfThenElseZero(covered, c), near_m), hn::Set(d, farther)));
    const auto level = hn::Max(hn::Max(hn::LoadU(di, beside + x), hn::LoadU(di, beside + x - 1)),
                               hn::Max(hn::LoadU(di, above + x), hn::LoadU(di, below + x)));
    const auto is = [&](int32_t l) HWY_ATTR { return Bits(hn::Eq(level, hn::Set(di, l))) << i; };
    out.covered |= Bits(covered) << i;
    out.own |= Bits(hn::And(covered, hn::RebindMask(di, own))) << i;
    out.weak |= is(kWeak), out.strong |= is(kStrong), out.edge |= is(kEdge);
  }
  return out;
}

void WriteRow(const PixelRow& row, float near_m, int last, float* depth_m, uint32_t* colour, uint16_t* normal) {
  const I32 di;
  const U32 du;
  const F32 d;
  const hn::Rebind<uint16_t, U32> d16;
  const int lanes = static_cast<int>(hn::Lanes(du));
  const auto write = [&](int x, float* to_depth, uint32_t* to_colour, uint16_t* to_normal) HWY_ATTR {
    const auto code = hn::LoadU(di, row.code + x);
    const auto nothing = hn::RebindMask(d, hn::Eq(code, hn::Set(di, kNoCode)));
    const auto infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    hn::StoreU(hn::IfThenElse(nothing, infinity, Metres(code, near_m)), d, to_depth);
    const auto low = hn::LoadU(du, row.attributes + x), high = hn::LoadU(du, row.normal_high + x);
    hn::StoreU(hn::And(low, hn::Set(du, 0xffffffu)), du, to_colour);
    const auto both = hn::Or(hn::ShiftRight<24>(low), hn::ShiftLeft<8>(high));
    hn::StoreU(hn::DemoteTo(d16, hn::BitCast(di, both)), d16, to_normal);
  };
  int x = 0;
  for (; x + lanes <= last; x += lanes) write(x, depth_m + x, colour + x, normal + x);
  if (lanes == 1 || x >= last) return;
  float depths[HWY_MAX_BYTES / 4];
  uint32_t colours[HWY_MAX_BYTES / 4];
  uint16_t normals[HWY_MAX_BYTES / 4];
  write(x, depths, colours, normals);
  const auto rest = static_cast<size_t>(last - x);
  std::memcpy(depth_m + x, depths, rest * sizeof(float));
  std::memcpy(colour + x, colours, rest * sizeof(uint32_t));
  std::memcpy(normal + x, normals, rest * sizeof(uint16_t));
}

}  // namespace telesplat::packer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
