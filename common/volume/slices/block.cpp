#include "common/volume/slices/block.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/volume/slices/block.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::volume::HWY_NAMESPACE {
#if HWY_TARGET == HWY_SCALAR

// Where there are no vectors: as the layout says, pixel by pixel. What the others must equal, too.

struct Residuals {
  uint8_t bytes[64][4][64];  // by group, plane and place in it
  uint8_t width[64][4];
  uint64_t mask;
  size_t size;
};

uint8_t Predicted(int predictor, const uint8_t* bytes, int x, int y, int c) {
  const auto at = [&](int px, int py) { return px < 0 || py < 0 ? 0 : bytes[(py * kBlockSide + px) * 4 + c]; };
  if (predictor == 0) return uint8_t(at(x, y - 1));
  if (predictor == 1) return uint8_t(at(x - 1, y));
  return uint8_t(at(x, y - 1) + at(x - 1, y) - at(x - 1, y - 1));
}

// Residual bit j of place i in a group's plane -> which bit of its packed bytes.
size_t PackedBit(int width, int place, int bit) {
  const int row = place / 16, column = place % 16;
  if (width == 8) return size_t(place * 8 + bit);
  const int four = width & 4, two = width & 2;
  if (bit < four) return size_t((row % 2 * 16 + column) * 8 + row / 2 * 4 + bit);
  if (bit < four + two) return size_t((four * 8 + column) * 8 + row * 2 + bit - four);
  return size_t((four * 8 + two * 8 + column % 8) * 8 + column / 8 * 4 + row);
}

size_t EncodeBlock(const uint32_t* pixels, uint8_t* out) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(pixels);
  std::vector<Residuals> all(3);
  for (int predictor = 0; predictor < 3; ++predictor) {
    Residuals& r = all[size_t(predictor)];
    r.mask = r.size = 0;
    for (int g = 0; g < 64; ++g) {
      int any[4] = {};
      for (int i = 0; i < 64; ++i) {
        const int x = g % 4 * 16 + i % 16, y = g / 4 * 4 + i / 16;
        uint8_t d[4];
        for (int c = 0; c < 4; ++c)
          d[c] = uint8_t(bytes[(y * kBlockSide + x) * 4 + c] - Predicted(predictor, bytes, x, y, c));
        d[0] = uint8_t(d[0] - d[1]), d[2] = uint8_t(d[2] - d[1]);
        for (int c = 0; c < 4; ++c) any[c] |= r.bytes[g][c][i] = uint8_t(d[c] << 1 ^ (d[c] > 127 ? 0xff : 0));
      }
      size_t bits = 0;
      for (int c = 0; c < 4; ++c) bits += r.width[g][c] = uint8_t(std::bit_width(unsigned(any[c])));
      if (bits != 0) r.mask |= uint64_t{1} << g, r.size += 2 + 8 * bits;
    }
  }
  const auto best = std::min_element(all.begin(), all.end(), [](auto& a, auto& b) { return a.size < b.size; });
  const Residuals& r = *best;
  uint8_t* to = out;
  *to++ = uint8_t(best - all.begin());
  for (int i = 0; i < 8; ++i) *to++ = uint8_t(r.mask >> (8 * i));
  for (int g = 0; g < 64; ++g) {
    if (!(r.mask >> g & 1)) continue;
    const auto& w = r.width[g];
    *to++ = uint8_t(w[0] | w[1] << 4), *to++ = uint8_t(w[2] | w[3] << 4);
  }
  for (int g = 0; g < 64; ++g)
    for (int c = 0; c < 4 && (r.mask >> g & 1) != 0; ++c) {
      const int width = r.width[g][c];
      std::fill_n(to, 8 * width, uint8_t{0});
      for (int i = 0; i < 64; ++i)
        for (int bit = 0; bit < width; ++bit) {
          const size_t at = PackedBit(width, i, bit);
          to[at / 8] = uint8_t(to[at / 8] | (r.bytes[g][c][i] >> bit & 1) << (at % 8));
        }
      to += 8 * width;
    }
  return size_t(to - out);
}

void DecodeBlock(int predictor, uint64_t mask, const uint8_t* widths, const uint8_t* payload, uint32_t* pixels) {
  auto* bytes = reinterpret_cast<uint8_t*>(pixels);
  std::fill_n(bytes, 4 * kBlockPixels, uint8_t{0});
  for (int g = 0; g < 64; ++g) {
    if (!(mask >> g & 1)) continue;
    const int width[4] = {widths[0] & 15, widths[0] >> 4, widths[1] & 15, widths[1] >> 4};
    widths += 2;
    uint8_t d[4][64] = {};
    for (int c = 0; c < 4; ++c) {
      for (int i = 0; i < 64; ++i) {
        unsigned v = 0;
        for (int bit = 0; bit < width[c]; ++bit) {
          const size_t at = PackedBit(width[c], i, bit);
          v |= (payload[at / 8] >> (at % 8) & 1u) << bit;
        }
        d[c][i] = uint8_t(v >> 1 ^ (v & 1 ? 0xff : 0));
      }
      payload += 8 * width[c];
    }
    for (int i = 0; i < 64; ++i)
      for (int c = 0; c < 4; ++c)
        bytes[((g / 4 * 4 + i / 16) * kBlockSide + g % 4 * 16 + i % 16) * 4 + c] =
            uint8_t(d[c][i] + (c == 0 || c == 2 ? d[1][i] : 0));
  }
  for (int y = 0; y < kBlockSide; ++y)
    for (int x = 0; x < kBlockSide; ++x)
      for (int c = 0; c < 4; ++c) {
        uint8_t& b = bytes[(y * kBlockSide + x) * 4 + c];
        b = uint8_t(b + Predicted(predictor, bytes, x, y, c));
      }
}

#else

namespace hn = hwy::HWY_NAMESPACE;

using U8 = hn::Full128<uint8_t>;
using U16 = hn::Full128<uint16_t>;
using U32 = hn::Full128<uint32_t>;
using U64 = hn::Full128<uint64_t>;
using Bytes16 = hn::VFromD<U8>;

constexpr U8 kU8;
constexpr int kGroupsAcross = 4, kGroupRows = 4, kGroups = 64;
constexpr size_t kRow = kBlockSide * 4;  // bytes of a row of pixels

// Shifts of every byte, whose bits must not leave it.
template <int kBits>
HWY_INLINE Bytes16 Up(Bytes16 v) {
  if constexpr (kBits == 0) return v;
  return hn::BitCast(kU8, hn::ShiftLeft<kBits>(hn::BitCast(U16(), v)));
}
template <int kBits>
HWY_INLINE Bytes16 Down(Bytes16 v) {
  if constexpr (kBits == 0) return v;
  return hn::BitCast(kU8, hn::ShiftRight<kBits>(hn::BitCast(U16(), v)));
}
// `kWide` bits from `kFrom` on of every byte, at the byte's lower end.
template <int kFrom, int kWide>
HWY_INLINE Bytes16 Bits(Bytes16 v) {
  return hn::And(Down<kFrom>(v), hn::Set(kU8, uint8_t((1 << kWide) - 1)));
}

HWY_INLINE Bytes16 Zigzag(Bytes16 v) {
  const hn::Full128<int8_t> d;
  const auto sign = hn::BitCast(kU8, hn::VecFromMask(d, hn::Lt(hn::BitCast(d, v), hn::Zero(d))));
  return hn::Xor(hn::Add(v, v), sign);
}
HWY_INLINE Bytes16 Unzigzag(Bytes16 v) {
  const auto half = hn::And(Down<1>(v), hn::Set(kU8, uint8_t{0x7f}));
  return hn::Xor(half, hn::Sub(hn::Zero(kU8), hn::And(v, hn::Set(kU8, uint8_t{1}))));
}

// The residuals of a block of pixels. kPredictor as in the header.
template <int kPredictor>
HWY_NOINLINE void Predict(const uint8_t* HWY_RESTRICT pixels, uint8_t* HWY_RESTRICT residuals) {
  alignas(16) static constexpr uint8_t kNothing[kRow] = {};
  for (int y = 0; y < kBlockSide; ++y) {
    const uint8_t* row = pixels + size_t(y) * kRow;
    const uint8_t* above = y > 0 ? row - kRow : kNothing;
    uint8_t* to = residuals + size_t(y) * kRow;
    auto last = hn::Zero(kU8);  // the vector before, whose last pixel is on the left of our first
    for (size_t x = 0; x < kRow; x += 16) {
      auto v = hn::LoadU(kU8, row + x);
      if constexpr (kPredictor != 1) v = hn::Sub(v, hn::LoadU(kU8, above + x));
      if constexpr (kPredictor != 0) {
        const auto left = hn::CombineShiftRightBytes<12>(kU8, v, last);
        last = v;
        v = hn::Sub(v, left);
      }
      hn::StoreU(v, kU8, to + x);
    }
  }
}

template <int kPredictor>
HWY_NOINLINE void Restore(uint8_t* HWY_RESTRICT pixels) {
  for (int y = 0; y < kBlockSide; ++y) {
    uint8_t* row = pixels + size_t(y) * kRow;
    auto sum = hn::Zero(kU8);  // of all on the left, in each of its pixels
    for (size_t x = 0; x < kRow; x += 16) {
      auto v = hn::LoadU(kU8, row + x);
      if constexpr (kPredictor != 0) {
        v = hn::Add(v, hn::ShiftLeftBytes<4>(kU8, v));
        v = hn::Add(v, hn::ShiftLeftBytes<8>(kU8, v));
        const auto whole = hn::BitCast(kU8, hn::Broadcast<3>(hn::BitCast(U32(), v)));
        v = hn::Add(v, sum);
        sum = hn::Add(sum, whole);
      }
      if constexpr (kPredictor != 1)
        if (y > 0) v = hn::Add(v, hn::LoadU(kU8, row + x - kRow));
      hn::StoreU(v, kU8, row + x);
    }
  }
}

struct Planes {
  alignas(16) uint8_t bytes[kGroups][4][64];  // residuals, by group and plane
  uint8_t width[kGroups][4];
  uint64_t mask;
  size_t size;  // of the payload
};

// Residuals in groups, less green, zigzagged, and how many bits they take.
HWY_NOINLINE void Split(const uint8_t* HWY_RESTRICT residuals, Planes& out) {
  out.mask = 0;
  out.size = 0;
  for (int g = 0; g < kGroups; ++g) {
    const uint8_t* from =
        residuals + size_t(g / kGroupsAcross * kGroupRows) * kRow + size_t(g % kGroupsAcross) * 16 * 4;
    Bytes16 any[4] = {hn::Zero(kU8), hn::Zero(kU8), hn::Zero(kU8), hn::Zero(kU8)};
    for (size_t r = 0; r < kGroupRows; ++r) {
      Bytes16 blue, green, red, alpha;
      hn::LoadInterleaved4(kU8, from + r * kRow, blue, green, red, alpha);
      const Bytes16 v[4] = {Zigzag(hn::Sub(blue, green)), Zigzag(green), Zigzag(hn::Sub(red, green)), Zigzag(alpha)};
      for (size_t p = 0; p < 4; ++p) {
        any[p] = hn::Or(any[p], v[p]);
        hn::Store(v[p], kU8, out.bytes[g][p] + r * 16);
      }
    }
    size_t bits = 0;
    for (size_t p = 0; p < 4; ++p) {
      alignas(16) uint64_t halves[2];
      hn::Store(hn::BitCast(U64(), any[p]), U64(), halves);
      uint64_t all = halves[0] | halves[1];
      all |= all >> 32, all |= all >> 16, all |= all >> 8;
      out.width[g][p] = uint8_t(std::bit_width(all & 0xff));
      bits += out.width[g][p];
    }
    if (bits == 0) continue;
    out.mask |= uint64_t{1} << g;
    out.size += 2 + 8 * bits;
  }
}

template <int kWidth>
HWY_INLINE void Pack(const Bytes16 (&v)[4], uint8_t* to) {
  if constexpr (kWidth == 8) {
    for (size_t r = 0; r < 4; ++r) hn::StoreU(v[r], kU8, to + 16 * r);
    return;
  }
  constexpr int kTwo = kWidth & 4, kOne = kWidth & 6;  // where the bits of weight two and one begin
  if constexpr ((kWidth & 4) != 0) {
    const auto bits = [&](size_t r) { return Bits<0, 4>(v[r]); };
    hn::StoreU(hn::Or(bits(0), Up<4>(bits(2))), kU8, to);
    hn::StoreU(hn::Or(bits(1), Up<4>(bits(3))), kU8, to + 16);
    to += 32;
  }
  if constexpr ((kWidth & 2) != 0) {
    const auto bits = [&](size_t r) { return Bits<kTwo, 2>(v[r]); };
    hn::StoreU(hn::Or(hn::Or(bits(0), Up<2>(bits(1))), hn::Or(Up<4>(bits(2)), Up<6>(bits(3)))), kU8, to);
    to += 16;
  }
  if constexpr ((kWidth & 1) != 0) {
    const auto bits = [&](size_t r) { return Bits<kOne, 1>(v[r]); };
    const auto t = hn::Or(hn::Or(bits(0), Up<1>(bits(1))), hn::Or(Up<2>(bits(2)), Up<3>(bits(3))));
    const auto both = hn::Or(t, Up<4>(hn::ShiftRightBytes<8>(kU8, t)));
    alignas(16) uint8_t half[16];
    hn::Store(both, kU8, half);
    std::memcpy(to, half, 8);
  }
}

template <int kWidth>
HWY_INLINE void Unpack(const uint8_t* from, Bytes16 (&v)[4]) {
  if constexpr (kWidth == 8) {
    for (size_t r = 0; r < 4; ++r) v[r] = hn::LoadU(kU8, from + 16 * r);
    return;
  }
  for (auto& row : v) row = hn::Zero(kU8);
  constexpr int kTwo = kWidth & 4, kOne = kWidth & 6;
  if constexpr ((kWidth & 4) != 0) {
    const auto a = hn::LoadU(kU8, from), b = hn::LoadU(kU8, from + 16);
    v[0] = Bits<0, 4>(a), v[1] = Bits<0, 4>(b), v[2] = Bits<4, 4>(a), v[3] = Bits<4, 4>(b);
    from += 32;
  }
  if constexpr ((kWidth & 2) != 0) {
    const auto a = hn::LoadU(kU8, from);
    v[0] = hn::Or(v[0], Up<kTwo>(Bits<0, 2>(a))), v[1] = hn::Or(v[1], Up<kTwo>(Bits<2, 2>(a)));
    v[2] = hn::Or(v[2], Up<kTwo>(Bits<4, 2>(a))), v[3] = hn::Or(v[3], Up<kTwo>(Bits<6, 2>(a)));
    from += 16;
  }
  if constexpr ((kWidth & 1) != 0) {
    alignas(16) uint8_t half[16];
    std::memcpy(half, from, 8);
    std::memcpy(half + 8, from, 8);
    const auto both = hn::Load(kU8, half);
    const auto low = hn::And(both, hn::Set(kU8, uint8_t{0x0f})), high = Bits<4, 4>(both);
    const auto t = hn::ConcatUpperLower(kU8, high, low);
    v[0] = hn::Or(v[0], Up<kOne>(Bits<0, 1>(t))), v[1] = hn::Or(v[1], Up<kOne>(Bits<1, 1>(t)));
    v[2] = hn::Or(v[2], Up<kOne>(Bits<2, 1>(t))), v[3] = hn::Or(v[3], Up<kOne>(Bits<3, 1>(t)));
  }
}

void PackAny(int width, const uint8_t* from, uint8_t* to) {
  Bytes16 v[4];
  for (size_t r = 0; r < 4; ++r) v[r] = hn::Load(kU8, from + 16 * r);
  switch (width) {
    case 1:
      return Pack<1>(v, to);
    case 2:
      return Pack<2>(v, to);
    case 3:
      return Pack<3>(v, to);
    case 4:
      return Pack<4>(v, to);
    case 5:
      return Pack<5>(v, to);
    case 6:
      return Pack<6>(v, to);
    case 7:
      return Pack<7>(v, to);
    case 8:
      return Pack<8>(v, to);
    default:
      return;
  }
}

HWY_INLINE void UnpackAny(int width, const uint8_t* from, Bytes16 (&v)[4]) {
  switch (width) {
    case 1:
      return Unpack<1>(from, v);
    case 2:
      return Unpack<2>(from, v);
    case 3:
      return Unpack<3>(from, v);
    case 4:
      return Unpack<4>(from, v);
    case 5:
      return Unpack<5>(from, v);
    case 6:
      return Unpack<6>(from, v);
    case 7:
      return Unpack<7>(from, v);
    case 8:
      return Unpack<8>(from, v);
    default:
      for (auto& row : v) row = hn::Zero(kU8);
  }
}

size_t EncodeBlock(const uint32_t* pixels, uint8_t* out) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(pixels);
  alignas(16) uint8_t residuals[4 * kBlockPixels];
  // The smallest of what the predictors give.
  Planes planes[2];
  int best = 0, predictor = 0;
  const auto attempt = [&](int which) {
    Planes& planes_of = planes[which == 0 ? 0 : 1 - best];
    Split(residuals, planes_of);
    if (which == 0 || planes_of.size < planes[best].size) {
      best = int(&planes_of - planes);
      predictor = which;
    }
  };
  Predict<0>(bytes, residuals);
  attempt(0);
  Predict<1>(bytes, residuals);
  attempt(1);
  Predict<2>(bytes, residuals);
  attempt(2);
  const Planes& chosen = planes[best];
  uint8_t* to = out;
  *to++ = uint8_t(predictor);
  for (int i = 0; i < 8; ++i) *to++ = uint8_t(chosen.mask >> (8 * i));
  for (uint64_t left = chosen.mask; left != 0; left &= left - 1) {
    const auto& w = chosen.width[std::countr_zero(left)];
    *to++ = uint8_t(w[0] | w[1] << 4), *to++ = uint8_t(w[2] | w[3] << 4);
  }
  for (uint64_t left = chosen.mask; left != 0; left &= left - 1) {
    const int g = std::countr_zero(left);
    for (int p = 0; p < 4; ++p) {
      PackAny(chosen.width[g][p], chosen.bytes[g][p], to);
      to += 8 * chosen.width[g][p];
    }
  }
  return size_t(to - out);
}

// Preconditions: a known predictor, widths of 0 to 8, and as many bytes as they say.
void DecodeBlock(int predictor, uint64_t mask, const uint8_t* widths, const uint8_t* payload, uint32_t* pixels) {
  auto* bytes = reinterpret_cast<uint8_t*>(pixels);
  std::memset(bytes, 0, 4 * kBlockPixels);
  for (; mask != 0; mask &= mask - 1, widths += 2) {
    const int g = std::countr_zero(mask);
    uint8_t* to = bytes + size_t(g / kGroupsAcross * kGroupRows) * kRow + size_t(g % kGroupsAcross) * 16 * 4;
    const int width[4] = {widths[0] & 15, widths[0] >> 4, widths[1] & 15, widths[1] >> 4};
    Bytes16 v[4][4];
    for (size_t p = 0; p < 4; ++p) {
      UnpackAny(width[p], payload, v[p]);
      payload += 8 * width[p];
    }
    for (size_t r = 0; r < kGroupRows; ++r) {
      const auto green = Unzigzag(v[1][r]);
      hn::StoreInterleaved4(hn::Add(Unzigzag(v[0][r]), green), green, hn::Add(Unzigzag(v[2][r]), green),
                            Unzigzag(v[3][r]), kU8, to + r * kRow);
    }
  }
  if (predictor == 0) Restore<0>(bytes);
  if (predictor == 1) Restore<1>(bytes);
  if (predictor == 2) Restore<2>(bytes);
}

#endif

}  // namespace telesplat::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::volume {

HWY_EXPORT(EncodeBlock);
HWY_EXPORT(DecodeBlock);

size_t encode_block(const uint32_t* pixels, uint8_t* out) { return HWY_DYNAMIC_DISPATCH(EncodeBlock)(pixels, out); }

Status decode_block(std::span<const uint8_t> bytes, uint32_t* pixels) {
  constexpr size_t kHead = 9;
  if (bytes.size() < kHead) return Error{fmt::format("a block of {} bytes, at least {}", bytes.size(), kHead)};
  if (bytes[0] > 2) return Error{fmt::format("a block with predictor {}, limit 2", bytes[0])};
  uint64_t mask = 0;
  for (size_t i = 0; i < 8; ++i) mask |= uint64_t{bytes[1 + i]} << (8 * i);
  const size_t widths = 2 * size_t(std::popcount(mask));
  if (bytes.size() < kHead + widths)
    return Error{fmt::format("a block of {} bytes, and {} groups in it", bytes.size(), widths / 2)};
  size_t expected = kHead + widths;
  int widest = 0;
  for (const uint8_t two : bytes.subspan(kHead, widths)) {
    const int a = two & 15, b = two >> 4;
    widest = std::max({widest, a, b});
    expected += 8 * size_t(a + b);
  }
  if (widest > 8) return Error{fmt::format("a plane {} bits wide, limit 8", widest)};
  if (bytes.size() != expected) return Error{fmt::format("a block of {} bytes, expected {}", bytes.size(), expected)};
  HWY_DYNAMIC_DISPATCH(DecodeBlock)(bytes[0], mask, &bytes[0] + kHead, &bytes[0] + kHead + widths, pixels);
  return ok_status();
}

}  // namespace telesplat::volume
#endif
