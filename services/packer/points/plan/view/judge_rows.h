// The part of judging pixels that vectors do: turns rows of keys into depths, steps and contrasts, on the widest
// vectors of the machine (Highway, chosen at run time).
#pragma once

#include <array>
#include <cstdint>

#include "common/splat/pixel_key.h"

namespace telesplat::packer {

/// Stands for no surface; beyond every depth code.
inline constexpr int32_t kNoCode = 1 << 20;

/// Pixels beyond the row's ends that vectors may read and write.
inline constexpr int kRowSlack = 64;

/// A row of pixels, one array per attribute. Arrays hold the tile's width, 2 kReach and slack on both sides; the
/// pointers point at pixel 0.
struct PixelRow {
  int32_t* code = nullptr;         ///< depth code without bias (pixel_key.h), or kNoCode
  uint32_t* attributes = nullptr;  ///< albedo in the low 24 bits, the normal's low byte above them
  uint32_t* normal_high = nullptr;
};

/// Biases of depth codes, by a key's spacing class and ring (class << 3 | ring).
using BiasTable = std::array<int32_t, 32>;
BiasTable bias_table(const splat::RimBias& rim);

/// Degree of difference between two neighbours.
enum Contrast : int32_t { kSame, kWeak, kStrong, kEdge };

/// Splits pixels [first, last) of a row of keys into `out`.
void split_row(const uint64_t* keys, int first, int last, const BiasTable& bias, const PixelRow& out);

/// Neighbours a and b, and the codes on the far sides of both. In a row a and b are the same row, one pixel apart.
struct NeighbourRows {
  const int32_t* before;
  const PixelRow &a, &b;
  const int32_t* after;
};
/// out[x] = contrast of pixel x of `a` with pixel x of `b`, for x in [first, last).
void compare_rows(const NeighbourRows& rows, int first, int last, int32_t* out);

/// Results for 64 pixels of a row from x on, as bits.
struct RowBits {
  uint64_t covered = 0;
  uint64_t own = 0;  ///< covered, and a point of the covering surface lies in the pixel
  uint64_t weak = 0, strong = 0, edge = 0;
};
/// A row and how it contrasts with what is around.
struct ContrastRow {
  const int32_t* code;
  const int32_t* beside;         ///< [x], [x - 1]: with the next and the previous pixel of the row
  const int32_t *above, *below;  ///< with pixels of the rows around
  const uint32_t* depth_bits;    ///< nearest points (depth_tile())
};
/// farther: 1 + relative epsilon.
RowBits judge_row_64(const ContrastRow& row, float near_m, float farther, int x);

/// Writes pixels [0, last) as planes: metres (+infinity: no surface), 0x00RRGGBB, 16-bit normals.
void write_row(const PixelRow& row, float near_m, int last, float* depth_m, uint32_t* colour, uint16_t* normal);

}  // namespace telesplat::packer
