// What the CPU splatter does inside one tile, on the widest vectors the machine has (Highway, chosen at run time).
// Every target computes the same pixels: no fused multiply-add, no approximate reciprocal.
//
// A point's position:  h = row . (x, y, z, 1)  for the three rows of its leaf's transform, summed from left to right,
//   fixed = floor(h.xy * (2^sub_bits / h.w) + shift)      (2^-sub_bits pixels; single precision)
//   first pixel = fixed >> sub_bits,  place within it = fixed & (2^sub_bits - 1)
// and its key: see splat_table.h.
#pragma once

#include <cstdint>
#include <span>

#include "common/splat/splat_table.h"
#include "common/splat/tile_binning.h"

namespace telesplat::splat {

/// Consecutive items of one cluster.
struct ItemRun {
  uint32_t first = 0, last = 0;  ///< items [first, last)
};

/// What of a view a tile draws. All arrays belong to the caller and are only read.
struct TileInput {
  geometry::Rect rect;  ///< the tile, inside the image
  float near_m = 0;     ///< nearer points are not drawn
  std::span<const TileBinning::Entry> entries;
  const ItemRun* runs = nullptr;              ///< one a box of the binning
  const LeafTransform* transforms = nullptr;  ///< likewise
  const DrawItem* items = nullptr;
};

/// Pixel keys of one tile with a margin on all sides, so that splats are not clipped: the margin is written, never read.
struct KeyBuffer {
  uint64_t* keys =
      nullptr;     ///< (rect.height + 2 margin) rows of `stride`; pixel (x, y) at (y + margin) * stride + x + margin
  int stride = 0;  ///< at least rect.width + 2 margin
  int margin = 0;  ///< at least the largest row_stride of the shapes
};

struct TileCounts {
  uint64_t projected = 0;  ///< points, counted again in each tile that they are tested for
  uint64_t drawn = 0;      ///< points whose splat's first pixel lies in this tile
};

/// Splats into buffer, whose pixels were kEmptyKey or hold what is there already.
///   shapes: one an item.  intensity: 65536 of 1/255, followed by 3 readable bytes.
TileCounts splat_tile(const TileInput& input, const SplatShape* const* shapes, const uint8_t* intensity,
                      const KeyBuffer& buffer);

/// Keys to colours (0xff000000 | 0x00RRGGBB, background where empty) and, if depth_m is not null, depths in metres (+infinity
/// where empty) of the points' centres. Sets the pixels to kEmptyKey again.
///   colour, depth_m: the tile's first pixel in images of `pitch` pixels a row.
void resolve_tile(const KeyBuffer& buffer, int width, int height, uint32_t background, uint32_t* colour, float* depth_m,
                  size_t pitch);

/// Least depth (bits of a positive float) of all points in each pixel, one pixel a point. depth_bits: rect.width * rect.height,
/// row-major, holding +infinity or what is there already.
void depth_tile(const TileInput& input, uint32_t* depth_bits);

/// The name of the instruction set in use.
const char* kernel_target();

}  // namespace telesplat::splat
