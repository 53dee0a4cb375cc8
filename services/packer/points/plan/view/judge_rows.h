// The part of judging pixels that is the same for all: rows of keys become depths, steps and contrasts, on the widest
// vectors the machine has (Highway, chosen at run time).
#pragma once

#include <array>
#include <cstdint>

#include "common/splat/pixel_key.h"

namespace telesplat::packer {

/// Beyond every depth code: nothing there.
inline constexpr int32_t kNoCode = 1 << 20;

/// Pixels beyond the asked ones that vectors may read and write.
inline constexpr int kRowSlack = 64;

/// A row of pixels, apart. Arrays of the tile's width, 2 kReach and slack on both sides; pixel 0 is where the pointers
/// point.
struct PixelRow {
  int32_t* code = nullptr;         ///< depth code without bias (pixel_key.h), or kNoCode
  uint32_t* attributes = nullptr;  ///< albedo in the low 24 bits, the normal's low byte above
  uint32_t* normal_high = nullptr;
};

/// A depth code's bias for the spacing class and ring of a key, (class << 3 | ring).
using BiasTable = std::array<int32_t, 32>;
BiasTable bias_table(const splat::RimBias& rim);

/// How two neighbours differ.
enum Contrast : int32_t { kSame, kWeak, kStrong, kEdge };

/// Pixels [first, last) of a row of keys.
void split_row(const uint64_t* keys, int first, int last, const BiasTable& bias, const PixelRow& out);

/// out[x] = contrast of pixel x of `a` with pixel x of `b`, for x in [first, last). before, after: the codes on the far
/// sides of both. For neighbours in a row a and b are the same row, one pixel apart.
void compare_rows(const int32_t* before, const PixelRow& a, const PixelRow& b, const int32_t* after, int first,
                  int last, int32_t* out);

/// 64 pixels of a row from x on, as bits.
struct RowBits {
  uint64_t covered = 0;
  uint64_t own = 0;  ///< covered, and a point of that surface lies in the pixel
  uint64_t weak = 0, strong = 0, edge = 0;
};
/// beside[x], beside[x - 1]: contrasts with the next and the previous pixel of the row; above, below: with those of the
/// rows around. depth_bits: nearest points (depth_tile()). farther: 1 + relative epsilon.
RowBits judge_row_64(const int32_t* code, const int32_t* beside, const int32_t* above, const int32_t* below,
                     const uint32_t* depth_bits, float near_m, float farther, int x);

/// Pixels [0, last) as planes: metres (+infinity where nothing is), 0x00RRGGBB, normals of 16 bits.
void write_row(const PixelRow& row, float near_m, int last, float* depth_m, uint32_t* colour, uint16_t* normal);

}  // namespace telesplat::packer
