// A pixel while a tile is splatted: one 64-bit key. The least key wins, compared as signed numbers.
//
//   bit 63       1 in every key; 0 outside a splat (kOutsideSplat flips it): larger than all keys
//   bits 62..45  depth code, 18 bits: (bits of the depth as float - bits of `near` as float) >> 9, that is 2^14
//                steps an octave, 16 octaves from `near` on; positive floats are ordered as their bits are
//   bits 44..43  spacing class: distance of the samples on the screen (spacing_class)
//   bits 42..40  ring: floor(8 q), at most 7; q = squared distance from the splat's centre, 1 on its contour
//   bits 39..24  normal (image/normal.h, 16 bits)
//   bits 23..0   albedo, RRGGBB
//
// The depth code is that of the surface at the pixel plus a bias that grows with q. So where splats of one surface
// overlap, the nearest centre wins, not the nearest depth, and large splats do not blur.
// Based on: M. Schuetz, M. Wimmer, "High-quality point-based rendering using fast single-pass interpolation", 2015
// (paraboloids).
//
// Resolving turns each key into the shaded colour, 0x00RRGGBB, and the info word
//   depth code << 8 | spacing class << 3 | ring, or kEmptyInfo for an empty pixel.
// They take the keys' place row by row (finish.h, ResolvedTile). Finish stages work on them; writing subtracts the
// ring's mean bias from the depth again (RimBias).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace telesplat::splat {

inline constexpr int kDepthCodeBits = 18;
inline constexpr int kDepthCodeShift = 9;  ///< a step of the depth code = 2^9 units of a float's last place
inline constexpr uint32_t kMaxBias = 81;   ///< 81 * 2^9 / 2^23 = 0.5 % of depth at most
inline constexpr uint32_t kMaxDepthCode = (1u << kDepthCodeBits) - 2;  ///< all ones means an empty key
/// Largest code of a centre, so that no bias takes it beyond kMaxDepthCode.
inline constexpr uint32_t kMaxCentreCode = kMaxDepthCode - kMaxBias;
inline constexpr int kKeyDepthBit = 45, kKeyClassBit = 43, kKeyRingBit = 40, kKeyNormalBit = 24;
inline constexpr uint64_t kKeySign = 1ull << 63;
inline constexpr uint64_t kOutsideSplat = 1ull << 63;  ///< turns a key's sign: above every key as a signed number
inline constexpr int64_t kEmptyKey = -1;               ///< an empty pixel: larger than every key
inline constexpr uint32_t kEmptyInfo = 0xffffffffu;    ///< an empty pixel

/// Depth code of a depth in metres, for a splat's centre. depth_m >= near_m > 0.
inline uint32_t encode_depth_code(float depth_m, float near_m) {
  return std::min((std::bit_cast<uint32_t>(depth_m) - std::bit_cast<uint32_t>(near_m)) >> kDepthCodeShift,
                  kMaxCentreCode);
}
/// The middle, in metres, of the depths that have this code: relative error at most 2^-15.
inline float decode_depth_code(uint32_t code, float near_m) {
  return std::bit_cast<float>(std::bit_cast<uint32_t>(near_m) + (code << kDepthCodeShift) +
                              (1u << (kDepthCodeShift - 1)));
}

/// Class of a distance of neighbouring samples on the screen: 0: < 1.3 px, 1: < 1.8 px, 2: < 3 px, 3: more.
constexpr uint32_t spacing_class(float spacing_px) {
  return spacing_px < 1.3f ? 0 : spacing_px < 1.8f ? 1 : spacing_px < 3.0f ? 2 : 3;
}
/// q: squared distance from the centre, 1 on the contour.
constexpr uint32_t ring_of(double q) { return static_cast<uint32_t>(std::min(8.0 * q, 7.0)); }

/// depth_code: bias included, at most kMaxDepthCode.
constexpr uint64_t encode_key(uint32_t depth_code, uint32_t spacing, uint32_t ring, uint32_t normal, uint32_t albedo) {
  return kKeySign | uint64_t{depth_code} << kKeyDepthBit | uint64_t{spacing} << kKeyClassBit |
         uint64_t{ring} << kKeyRingBit | uint64_t{normal} << kKeyNormalBit | albedo;
}
constexpr uint32_t key_depth_code(uint64_t key) { return static_cast<uint32_t>(key >> kKeyDepthBit) & 0x3ffff; }
constexpr uint32_t key_spacing(uint64_t key) { return static_cast<uint32_t>(key >> kKeyClassBit) & 3; }
constexpr uint32_t key_ring(uint64_t key) { return static_cast<uint32_t>(key >> kKeyRingBit) & 7; }
constexpr uint32_t key_normal(uint64_t key) { return static_cast<uint32_t>(key >> kKeyNormalBit) & 0xffff; }
constexpr uint32_t key_albedo(uint64_t key) { return static_cast<uint32_t>(key) & 0xffffff; }

/// The info word of a key that is not empty.
constexpr uint32_t key_info(uint64_t key) {
  return key_depth_code(key) << 8 | (static_cast<uint32_t>(key >> kKeyRingBit) & 31);
}
/// Colour and info in one word.
constexpr uint64_t encode_pair(uint32_t colour, uint32_t info) { return uint64_t{info} << 32 | colour; }
constexpr uint32_t pair_colour(uint64_t pair) { return static_cast<uint32_t>(pair); }
constexpr uint32_t pair_info(uint64_t pair) { return static_cast<uint32_t>(pair >> 32); }
constexpr uint32_t info_depth_code(uint32_t info) { return info >> 8; }
constexpr uint32_t info_spacing(uint32_t info) { return info >> 3 & 3; }
constexpr uint32_t info_ring(uint32_t info) { return info & 7; }

/// For each spacing class, the bias (in depth codes) of a frame's splats on their contours: the mean over their points.
using RimBias = std::array<uint32_t, 4>;
/// The depth code minus its bias, which is estimated as rim * (ring + 1/2) / 8: at most rim / 16 codes off if all
/// splats of a class have the same bias. Rounded; at least 0.
constexpr uint32_t unbiased_depth_code(uint32_t info, const RimBias& rim) {
  const uint32_t bias = (rim[info_spacing(info)] * (2 * info_ring(info) + 1) + 8) >> 4;
  const uint32_t code = info_depth_code(info);
  return code - std::min(bias, code);
}

}  // namespace telesplat::splat
