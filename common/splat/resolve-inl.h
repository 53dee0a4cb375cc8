// From pixel keys to colours and depths.
// Included once a target, by splat_kernels.cpp.
#if defined(TELESPLAT_SPLAT_RESOLVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_RESOLVE_INL_H_
#undef TELESPLAT_SPLAT_RESOLVE_INL_H_
#else
#define TELESPLAT_SPLAT_RESOLVE_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "common/splat/splat_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Pixels processed at once. A row's last vector may reach beyond it, into the buffer's margin: never wider than that.
using PixelU32 = hn::CappedTag<uint32_t, kMaxSplatSide>;
using PixelI32 = hn::RebindToSigned<PixelU32>;
using PixelF32 = hn::RebindToFloat<PixelU32>;
using Pixels = hn::Vec<PixelU32>;

// Low and high halves of keys.
struct Halves {
  Pixels low, high;
};
HWY_INLINE Halves LoadHalves(const uint64_t* p) {
  Halves h;
  hn::LoadInterleaved2(PixelU32(), reinterpret_cast<const uint32_t*>(p), h.low, h.high);
  return h;
}
HWY_INLINE void StoreEmpty(uint64_t* p) {
  const PixelU32 d;
  const auto empty = hn::Set(d, 0xffffffffu);
  hn::StoreU(empty, d, reinterpret_cast<uint32_t*>(p));
  hn::StoreU(empty, d, reinterpret_cast<uint32_t*>(p) + hn::Lanes(d));
}
HWY_INLINE hn::Mask<PixelU32> IsEmpty(Pixels high) { return hn::Eq(high, hn::Set(PixelU32(), kEmptyInfo)); }

// image::Shading::apply on each lane, with intensities in bytes: (c * i + 127) / 255 for each channel; v / 255 = (v + 1
// + (v >> 8)) >> 8 for v < 65535.
HWY_INLINE Pixels Shade(Pixels albedo, const uint8_t* HWY_RESTRICT light) {
  const PixelU32 d;
  const auto i = hn::PromoteTo(d, hn::LoadU(hn::Rebind<uint8_t, PixelU32>(), light));
  const auto red_blue = hn::Set(d, 0x00ff00ffu), green = hn::Set(d, 0x000000ffu);
  const auto rb = hn::Add(hn::Mul(hn::And(albedo, red_blue), i), hn::Set(d, 0x007f007fu));
  const auto g = hn::Add(hn::Mul(hn::And(hn::ShiftRight<8>(albedo), green), i), hn::Set(d, 0x7fu));
  const auto rb_over = hn::Add(hn::Add(rb, hn::Set(d, 0x00010001u)), hn::And(hn::ShiftRight<8>(rb), red_blue));
  const auto g_over = hn::Add(hn::Add(g, hn::Set(d, 1u)), hn::ShiftRight<8>(g));
  return hn::Or(hn::And(hn::ShiftRight<8>(rb_over), red_blue), hn::And(g_over, hn::Set(d, 0xff00u)));
}

// Looks up intensities of `n` keys' normals, by scalars: 8-lane gathers took longer (bench splat_square, resolve_ms).
HWY_INLINE void LookUpLight(const uint64_t* HWY_RESTRICT keys, size_t n, const uint8_t* HWY_RESTRICT intensity,
                            uint8_t* HWY_RESTRICT light) {
#pragma GCC unroll 8
  for (size_t i = 0; i < n; ++i) light[i] = intensity[key_normal(keys[i])];
}

// key_info of each lane.
HWY_INLINE Pixels InfoOf(Pixels high) {
  const PixelU32 d;
  return hn::Or(hn::ShiftRight<5>(hn::And(high, hn::Set(d, 0x7fffe000u))),
                hn::And(hn::ShiftRight<8>(high), hn::Set(d, 31)));
}

// decode_depth_code(unbiased_depth_code(info)) of each lane; undefined for empty ones.
HWY_INLINE hn::Vec<PixelF32> DepthOf(Pixels info, const ResolveInput& input) {
  const PixelU32 d;
  const PixelI32 di;
  const auto odd = hn::Ne(hn::And(info, hn::Set(d, 8)), hn::Zero(d)),
             upper = hn::Ne(hn::And(info, hn::Set(d, 16)), hn::Zero(d));
  const auto rim = hn::IfThenElse(upper, hn::IfThenElse(odd, hn::Set(d, input.rim[3]), hn::Set(d, input.rim[2])),
                                  hn::IfThenElse(odd, hn::Set(d, input.rim[1]), hn::Set(d, input.rim[0])));
  const auto eighths = hn::Or(hn::Add(hn::And(info, hn::Set(d, 7)), hn::And(info, hn::Set(d, 7))), hn::Set(d, 1));
  const auto bias = hn::ShiftRight<4>(hn::Add(hn::Mul(rim, eighths), hn::Set(d, 8)));
  const auto code = hn::Max(hn::BitCast(di, hn::Sub(hn::ShiftRight<8>(info), bias)), hn::Zero(di));
  const uint32_t first = std::bit_cast<uint32_t>(input.near_m) + (1u << (kDepthCodeShift - 1));
  return hn::BitCast(PixelF32(), hn::Add(hn::ShiftLeft<kDepthCodeShift>(hn::BitCast(d, code)), hn::Set(d, first)));
}

// Pixels are made a chunk at a time in the first-level cache. They leave it as whole lines, past the other caches: they
// are not read again soon, and a line that is not written in one go would first be read from memory.
constexpr size_t kChunk = 256;

HWY_INLINE void StreamOut(const uint32_t* HWY_RESTRICT from, uint32_t* HWY_RESTRICT to, size_t n) {
  const PixelU32 d;
  constexpr size_t kLine = 16;  // words of a cache line
  const size_t misaligned = reinterpret_cast<uintptr_t>(to) / sizeof(uint32_t) % kLine;
  const size_t head = std::min(n, misaligned == 0 ? 0 : kLine - misaligned);
  std::memcpy(to, from, head * sizeof(uint32_t));
  size_t i = head;
  for (; i + kLine <= n; i += kLine)
    for (size_t j = i; j < i + kLine; j += hn::Lanes(d)) hn::Stream(hn::LoadU(d, from + j), d, to + j);
  std::memcpy(to + i, from + i, (n - i) * sizeof(uint32_t));
}

// Writes a chunk: put vectors of pixels, then flush. kDepth: writes depths, too.
template <bool kDepth>
class ChunkWriter {
 public:
  ChunkWriter(const ResolveInput& input, const TileTarget& target) : input_(input), target_(target) {}

  HWY_INLINE void put(size_t i, Pixels colour, Pixels info) {
    const PixelU32 d;
    hn::Store(hn::Or(colour, hn::Set(d, 0xff000000u)), d, colour_ + i);
    if (!kDepth) return;
    const auto infinity = hn::Set(d, std::bit_cast<uint32_t>(std::numeric_limits<float>::infinity()));
    hn::Store(hn::IfThenElse(IsEmpty(info), infinity, hn::BitCast(d, DepthOf(info, input_))), d, depth_bits_ + i);
  }
  HWY_INLINE void flush(int x, int y, size_t n) {
    const size_t at = static_cast<size_t>(y) * target_.pitch + static_cast<size_t>(x);
    StreamOut(colour_, target_.colour + at, n);
    if (kDepth) StreamOut(depth_bits_, reinterpret_cast<uint32_t*>(target_.depth_m) + at, n);
  }

 private:
  const ResolveInput& input_;
  const TileTarget target_;
  HWY_ALIGN uint32_t colour_[kChunk];
  HWY_ALIGN uint32_t depth_bits_[kChunk];
};

// Colours and infos of a vector of keys.
struct Resolved {
  Pixels colour, info;
};
HWY_INLINE Resolved Resolve(const Halves& key, const uint8_t* light, const ResolveInput& input) {
  const PixelU32 d;
  const auto empty = IsEmpty(key.high);
  return {hn::IfThenElse(empty, hn::Set(d, input.background), Shade(key.low, light)),
          hn::Or(InfoOf(key.high), hn::VecFromMask(d, empty))};
}

void ResolveTile(const ResolvedTile& tile, int reach, const ResolveInput& input, std::vector<uint64_t>& scratch) {
  const PixelU32 d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN uint8_t light[kChunk + kMaxSplatSide];
  // Copies a row's keys before its colours and infos take their place.
  const auto columns = static_cast<size_t>(tile.width + 2 * reach);
  scratch.resize(std::max(scratch.size(), columns + kMaxSplatSide));
  for (int y = -reach; y < tile.height + reach; ++y) {
    uint32_t *colour = tile.colour(y) - reach, *info = tile.info(y) - reach;
    std::memcpy(scratch.data(), tile.key(y) - reach, columns * sizeof(uint64_t));
    for (size_t x = 0; x < columns; x += kChunk) {
      const size_t n = std::min(kChunk, columns - x);
      const uint64_t* keys = scratch.data() + x;
      LookUpLight(keys, n, input.intensity, light);
      for (size_t i = 0; i < n; i += lanes) {
        const Resolved pixels = Resolve(LoadHalves(keys + i), light + i, input);
        hn::StoreU(pixels.colour, d, colour + x + i);
        hn::StoreU(pixels.info, d, info + x + i);
      }
    }
  }
}

template <bool kDepth>
void WriteTileAs(const ResolvedTile& tile, int reach, const ResolveInput& input, const TileTarget& target) {
  const PixelU32 d;
  const size_t lanes = hn::Lanes(d);
  ChunkWriter<kDepth> out(input, target);
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; x += kChunk) {
      const size_t n = std::min(kChunk, static_cast<size_t>(tile.width - x));
      const uint32_t *colour = tile.colour(y) + x, *info = tile.info(y) + x;
      for (size_t i = 0; i < n; i += lanes) out.put(i, hn::LoadU(d, colour + i), hn::LoadU(d, info + i));
      out.flush(x, y, n);
    }
  hwy::FlushStream();
  for (int y = -reach; y < tile.height + reach; ++y)
    std::fill_n(tile.key(y) - reach, tile.width + 2 * reach, static_cast<uint64_t>(kEmptyKey));
}

template <bool kDepth>
void ResolveAndWriteTileAs(const ResolvedTile& tile, const ResolveInput& input, const TileTarget& target) {
  const size_t lanes = hn::Lanes(PixelU32());
  HWY_ALIGN uint8_t light[kChunk + kMaxSplatSide];
  ChunkWriter<kDepth> out(input, target);
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; x += kChunk) {
      uint64_t* keys = tile.key(y) + x;
      const size_t n = std::min(kChunk, static_cast<size_t>(tile.width - x));
      LookUpLight(keys, n, input.intensity, light);
      for (size_t i = 0; i < n; i += lanes) {
        const Halves key = LoadHalves(keys + i);
        StoreEmpty(keys + i);
        const Resolved pixels = Resolve(key, light + i, input);
        out.put(i, pixels.colour, pixels.info);
      }
      out.flush(x, y, n);
    }
  hwy::FlushStream();
}

void WriteTile(const ResolvedTile& tile, int reach, const ResolveInput& input, const TileTarget& target) {
  (target.depth_m ? WriteTileAs<true> : WriteTileAs<false>)(tile, reach, input, target);
}

void ResolveAndWriteTile(const ResolvedTile& tile, const ResolveInput& input, const TileTarget& target) {
  (target.depth_m ? ResolveAndWriteTileAs<true> : ResolveAndWriteTileAs<false>)(tile, input, target);
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
