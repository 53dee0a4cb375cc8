// One tile of the warp. Dispatches to the best instruction set at run time; all give the same pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace telesplat::volume {

inline constexpr int kWarpTileWidth = 64, kWarpTileHeight = 32;
/// Tiles are skipped in parts of this size, layer by layer. A multiple of all vectors' widths.
inline constexpr int kWarpPartWidth = 16, kWarpPartHeight = 4;
inline constexpr int kWarpPartsX = kWarpTileWidth / kWarpPartWidth, kWarpPartsY = kWarpTileHeight / kWarpPartHeight;

inline constexpr int kWarpSubtexels = 128;     ///< steps of bilinear weights
inline constexpr int kWarpOpaque = 255 * 128;  ///< opacity 1, in the accumulators' steps
inline constexpr int kWarpDone = 64;           ///< less transparency than this is none: half of an 8-bit step
inline constexpr float kWarpNearestW = 1e-6f;  ///< rays with less than this do not meet the plane

/// A layer, as a tile sees it. With (x, y) counted from the tile's corner, at a pixel's centre + 0,
///   X = (x0 + y xy) + x xx, Y and W likewise;  texel (X / W + shift_x, Y / W + shift_y) / kWarpSubtexels, clamped to [0, last], rounded.
/// X and Y are relative to a texel near the tile (which shift_x, shift_y add again, and a half), so that floats have enough digits.
struct WarpLayer {
  float x0, xx, xy, y0, yx, yy, w0, wx, wy;
  float shift_x, shift_y, last_x, last_y;
  float depth;  ///< times 1 / W: metres
  int32_t pitch;
  const uint32_t* texels;
};

struct WarpTile {
  const WarpLayer* layers = nullptr;  ///< at most 64, front to back
  /// Bit i: layer i may have anything in this part.
  std::array<uint64_t, kWarpPartsX * kWarpPartsY> parts{};
  uint32_t background = 0;
  // Pixels [x0, x1) x [y0, y1) of the tile are drawn.
  int x0 = 0, y0 = 0, x1 = kWarpTileWidth, y1 = kWarpTileHeight;
  uint32_t* colour = nullptr;  ///< of pixel (0, 0), whether drawn or not
  float* depth_m = nullptr;    ///< likewise, or null
  ptrdiff_t pitch = 0;         ///< pixels from row to row, of both
};

/// Returns the number of bilinear look-ups.
uint64_t warp_tile(const WarpTile& tile);

}  // namespace telesplat::volume
