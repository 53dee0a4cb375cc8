// From pixel keys to colours and depths.
// Included once a target, by splat_kernels.cpp.
#if defined(TELESPLAT_SPLAT_RESOLVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_RESOLVE_INL_H_
#undef TELESPLAT_SPLAT_RESOLVE_INL_H_
#else
#define TELESPLAT_SPLAT_RESOLVE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "common/splat/splat_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Pixels at once. A row's last vector may reach beyond it, into the buffer's margin: never wider than that.
using PixelU32 = hn::CappedTag<uint32_t, kMaxSplatSide>;
using PixelI32 = hn::RebindToSigned<PixelU32>;
using PixelF32 = hn::RebindToFloat<PixelU32>;
using Pixels = hn::Vec<PixelU32>;

// Low and high halves of keys or pairs.
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

// image::Shading::apply on each lane: (c * i + 127) / 255 for each channel; v / 255 = (v + 1 + (v >> 8)) >> 8 for v < 65535.
HWY_INLINE Pixels Shade(Pixels albedo, Pixels i) {
  const PixelU32 d;
  const auto red_blue = hn::Set(d, 0x00ff00ff), green = hn::Set(d, 0x000000ff);
  const auto rb = hn::Add(hn::Mul(hn::And(albedo, red_blue), i), hn::Set(d, 0x007f007f));
  const auto g = hn::Add(hn::Mul(hn::And(hn::ShiftRight<8>(albedo), green), i), hn::Set(d, 0x7f));
  const auto rb_over = hn::Add(hn::Add(rb, hn::Set(d, 0x00010001)), hn::And(hn::ShiftRight<8>(rb), red_blue));
  const auto g_over = hn::Add(hn::Add(g, hn::Set(d, 1)), hn::ShiftRight<8>(g));
  return hn::Or(hn::And(hn::ShiftRight<8>(rb_over), red_blue), hn::And(g_over, hn::Set(d, 0xff00)));
}

// Shaded colours of keys; of empty ones, anything.
HWY_INLINE Pixels ColourOf(const Halves& key, const uint8_t* intensity) {
  const PixelU32 d;
  const PixelI32 di;
  const auto normal = hn::Or(hn::ShiftLeft<8>(hn::And(key.high, hn::Set(d, 0xff))), hn::ShiftRight<24>(key.low));
  const auto light = hn::GatherOffset(di, reinterpret_cast<const int32_t*>(intensity), hn::BitCast(di, normal));
  return Shade(key.low, hn::And(hn::BitCast(d, light), hn::Set(d, 255)));
}

// key_info of each lane.
HWY_INLINE Pixels InfoOf(Pixels high) {
  const PixelU32 d;
  return hn::Or(hn::ShiftRight<5>(hn::And(high, hn::Set(d, 0x7fffe000u))),
                hn::And(hn::ShiftRight<8>(high), hn::Set(d, 31)));
}

// decode_depth_code(unbiased_depth_code(info)) of each lane; of empty ones, anything.
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

// Writes one vector of pixels, of which the row has `n` left.
HWY_INLINE void WritePixels(Pixels colour, Pixels info, hn::Mask<PixelU32> empty, const ResolveInput& input, size_t n,
                            uint32_t* out_colour, float* out_depth_m) {
  const PixelU32 d;
  const PixelF32 df;
  const size_t lanes = hn::Lanes(d);
  const auto shown = hn::Or(colour, hn::Set(d, 0xff000000u));
  const auto depth = [&]() HWY_ATTR {
    return hn::IfThenElse(hn::RebindMask(df, empty), hn::Set(df, std::numeric_limits<float>::infinity()),
                          DepthOf(info, input));
  };
  if (n >= lanes) {
    // Ordinary stores: past the caches they took three times as long (bench splat_square, resolve_ms).
    hn::StoreU(shown, d, out_colour);
    if (out_depth_m) hn::StoreU(depth(), df, out_depth_m);
    return;
  }
  HWY_ALIGN uint32_t last_colour[kMaxSplatSide];
  HWY_ALIGN float last_depth[kMaxSplatSide];
  hn::Store(shown, d, last_colour);
  std::memcpy(out_colour, last_colour, n * sizeof(uint32_t));
  if (!out_depth_m) return;
  hn::Store(depth(), df, last_depth);
  std::memcpy(out_depth_m, last_depth, n * sizeof(float));
}

void ResolveTile(const ResolvedTile& tile, int reach, const ResolveInput& input, std::vector<uint64_t>& scratch) {
  const PixelU32 d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto background = hn::Set(d, input.background), nothing = hn::Set(d, kEmptyInfo);
  // A row's keys leave their place before its colours and infos take it.
  const int columns = tile.width + 2 * reach;
  scratch.resize(std::max(scratch.size(), static_cast<size_t>(columns + lanes)));
  for (int y = -reach; y < tile.height + reach; ++y) {
    uint32_t *colour = tile.colour(y) - reach, *info = tile.info(y) - reach;
    std::memcpy(scratch.data(), tile.key(y) - reach, static_cast<size_t>(columns) * sizeof(uint64_t));
    for (int x = 0; x < columns; x += lanes) {
      const Halves key = LoadHalves(scratch.data() + x);
      const auto empty = IsEmpty(key.high);
      if (hn::AllTrue(d, empty)) {
        hn::StoreU(background, d, colour + x);
        hn::StoreU(nothing, d, info + x);
        continue;
      }
      hn::StoreU(hn::IfThenElse(empty, background, ColourOf(key, input.intensity)), d, colour + x);
      hn::StoreU(hn::IfThenElse(empty, nothing, InfoOf(key.high)), d, info + x);
    }
  }
}

void WriteTile(const ResolvedTile& tile, int reach, const ResolveInput& input, const TileTarget& target) {
  const PixelU32 d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int y = 0; y < tile.height; ++y) {
    uint32_t* colour = target.colour + static_cast<size_t>(y) * target.pitch;
    float* depth_m = target.depth_m ? target.depth_m + static_cast<size_t>(y) * target.pitch : nullptr;
    for (int x = 0; x < tile.width; x += lanes) {
      const auto info = hn::LoadU(d, tile.info(y) + x);
      WritePixels(hn::LoadU(d, tile.colour(y) + x), info, IsEmpty(info), input, static_cast<size_t>(tile.width - x),
                  colour + x, depth_m ? depth_m + x : nullptr);
    }
  }
  for (int y = -reach; y < tile.height + reach; ++y)
    std::fill_n(tile.key(y) - reach, tile.width + 2 * reach, static_cast<uint64_t>(kEmptyKey));
}

void ResolveAndWriteTile(const ResolvedTile& tile, const ResolveInput& input, const TileTarget& target) {
  const PixelU32 d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto background = hn::Set(d, input.background);
  for (int y = 0; y < tile.height; ++y) {
    uint64_t* row = tile.key(y);
    uint32_t* colour = target.colour + static_cast<size_t>(y) * target.pitch;
    float* depth_m = target.depth_m ? target.depth_m + static_cast<size_t>(y) * target.pitch : nullptr;
    for (int x = 0; x < tile.width; x += lanes) {
      const Halves key = LoadHalves(row + x);
      const auto empty = IsEmpty(key.high);
      const auto n = static_cast<size_t>(tile.width - x);
      float* out_depth_m = depth_m ? depth_m + x : nullptr;
      if (hn::AllTrue(d, empty)) {
        WritePixels(background, key.high, empty, input, n, colour + x, out_depth_m);
        continue;
      }
      StoreEmpty(row + x);
      WritePixels(hn::IfThenElse(empty, background, ColourOf(key, input.intensity)), InfoOf(key.high), empty, input, n,
                  colour + x, out_depth_m);
    }
  }
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
