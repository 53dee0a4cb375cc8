// Warps one tile. Chooses the best instruction set at run time; all give the same pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace telesplat::volume {

inline constexpr int kWarpTileWidth = 64, kWarpTileHeight = 32;
/// Tiles are skipped in parts of this size, layer by layer. A multiple of every vector width.
inline constexpr int kWarpPartWidth = 16, kWarpPartHeight = 4;
inline constexpr int kWarpPartsX = kWarpTileWidth / kWarpPartWidth, kWarpPartsY = kWarpTileHeight / kWarpPartHeight;

inline constexpr int kWarpSubtexels = 128;     ///< steps of bilinear weights
inline constexpr int kWarpOpaque = 255 * 128;  ///< opacity 1, in the accumulators' steps
inline constexpr int kWarpDone = 64;           ///< less transparency counts as 0: half of an 8-bit step
inline constexpr int kWarpSolid = 255 * 96;    ///< transparency at which a pixel is solid: 1 - kSolid
inline constexpr float kWarpNearestW = 1e-6f;  ///< rays with a smaller W do not meet the plane

/// A layer, as a tile sees it. With (x, y) counted from the middle of the tile's first pixel,
///   X = (x0 + y xy) + x xx, Y and W likewise;  bits = bits of (clamp(X / W, least_x, most_x) + shift_x)
/// The lower bits are the place in the image, in 1 / kWarpSubtexels of a texel, rounded. X and Y count from a texel
/// near the tile, which keeps their digits. shift_x and shift_y add that texel's place, and 2^23, which leaves a whole
/// number in the lower bits.
struct WarpLayer {
  float x0, xx, xy, y0, yx, yy, w0, wx, wy;
  float least_x, most_x, shift_x, least_y, most_y, shift_y;
  float depth;  ///< times 1 / W: metres
  int32_t pitch;
  const uint32_t* texels;
};
inline constexpr float kWarpMagic = 8388608.0f;  ///< 2^23: a sum with a smaller whole number has it in its lower bits
inline constexpr int32_t kWarpMagicTexels =
    0xffff;  ///< the place's part of bits >> 7; kMaxRasterSide + 3 is less than half of it

struct WarpTile {
  const WarpLayer* layers = nullptr;  ///< at most 64, front to back
  /// Bit i: layer i may have visible texels in this part.
  std::array<uint64_t, kWarpPartsX * kWarpPartsY> parts{};
  uint32_t background = 0;
  // Pixels [x0, x1) x [y0, y1) of the tile are drawn.
  int x0 = 0, y0 = 0, x1 = kWarpTileWidth, y1 = kWarpTileHeight;
  uint32_t* colour = nullptr;  ///< address of pixel (0, 0), even if it is not drawn
  float* depth_m = nullptr;    ///< likewise, or null
  ptrdiff_t pitch = 0;         ///< pixels from row to row of both
};

/// Returns the number of bilinear look-ups.
uint64_t warp_tile(const WarpTile& tile);

}  // namespace telesplat::volume
