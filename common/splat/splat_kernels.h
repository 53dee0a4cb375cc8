// Work of the CPU splatter inside one tile, on the widest vectors of the machine (Highway, chosen at run time). Every
// target computes the same pixels: no fused multiply-add, no approximate reciprocal.
//
// A point's position:  h = row . (x, y, z, 1)  for the three rows of its leaf's transform, summed from left to right,
//   fixed = floor(h.xy * (2^sub_bits / h.w) + shift)      (2^-sub_bits pixels; single precision)
//   first pixel = fixed >> sub_bits,  place within it = fixed & (2^sub_bits - 1)
// and its key: see pixel_key.h; its addend in each pixel it covers: see flat/splat_table.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/splat/finish.h"
#include "common/splat/flat/splat_table.h"
#include "common/splat/pixel_key.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/tile_binning.h"

namespace telesplat::splat {

/// Consecutive items of one cluster.
struct ItemRun {
  uint32_t first = 0, last = 0;  ///< items [first, last)
};

/// The part of a view that a tile draws. All arrays belong to the caller and are only read.
struct TileInput {
  /// The area to draw: the tile, grown by the pixels around it that the finish reads. It may reach beyond the image.
  geometry::Rect rect;
  geometry::Rect own;  ///< the tile itself, inside the image: counts the points that fall into it
  float near_m = 0;    ///< nearer points are not drawn
  std::span<const TileBinning::Entry> entries;
  const ItemRun* runs = nullptr;              ///< one a box of the binning
  const LeafTransform* transforms = nullptr;  ///< one a box
  const glm::vec3* facing = nullptr;          ///< one a box: facing_vector(), for items that may face away
  const DrawItem* items = nullptr;
};

/// Style of an item's points.
struct ItemStyle {
  const SplatShape* shape = nullptr;
  uint32_t spacing = 0;  ///< spacing_class of its samples
  bool operator==(const ItemStyle&) const = default;
};

/// Pixel keys of one tile's rect with a margin on all sides, so that splats are not clipped: the margin is written,
/// never read.
struct KeyBuffer {
  /// (rect.height + 2 margin) rows of `stride`; pixel (x, y) at (y + margin) * stride + x + margin.
  uint64_t* keys = nullptr;
  int stride = 0;  ///< at least rect.width + 2 margin
  int margin = 0;  ///< at least kMaxSplatSide
};

struct TileCounts {
  uint64_t projected = 0;  ///< points, counted in each tile that tests them
  uint64_t drawn = 0;      ///< points whose splat's first pixel lies in `own`
};

/// Splats squares or discs into buffer, whose pixels hold kEmptyKey or keys drawn before (pixel_key.h).
///   styles: one an item.
TileCounts splat_tile(const TileInput& input, const ItemStyle* styles, const KeyBuffer& buffer);

/// Parameters that turn keys into colours and depths.
struct ResolveInput {
  const uint8_t* intensity = nullptr;  ///< 65536 intensities in 1/255, followed by 3 readable bytes
  uint32_t background = 0;             ///< 0x00RRGGBB
  float near_m = 0;
  RimBias rim{};
};

/// The tile's first pixel in images of `pitch` pixels a row.
struct TileTarget {
  uint32_t* colour = nullptr;
  float* depth_m = nullptr;  ///< may be null
  size_t pitch = 0;
};

/// Turns keys into colours and infos, each row in its keys' place: the tile and `reach` pixels around it. Empty pixels
/// get the background's colour. tile.margin is at least reach + kFinishSlack. scratch: memory kept from tile to tile.
void resolve_tile(const ResolvedTile& tile, int reach, const ResolveInput& input, std::vector<uint64_t>& scratch);

/// Writes colours (0xff000000 | 0x00RRGGBB) and, if target.depth_m is not null, depths in metres without the bias
/// (+infinity for empty pixels). Then turns the tile and its reach into empty keys again; leaves the rest of the rows
/// as the stages left it.
void write_tile(const ResolvedTile& tile, int reach, const ResolveInput& input, const TileTarget& target);

/// resolve_tile and write_tile in one pass, for tiles without reach.
void resolve_and_write_tile(const ResolvedTile& tile, const ResolveInput& input, const TileTarget& target);

/// The last bits of a reference depth hold the point's place in its pixel: x, and above it y, in 2^-kReferenceSubBits
/// pixels. So relative errors of depths are at most 2^-15.
inline constexpr int kReferenceSubBits = 4;
inline constexpr uint32_t kReferencePlaceMask = (1u << 2 * kReferenceSubBits) - 1;

/// Least depth of all points in each pixel, one pixel a point, as the bits of a positive float with the point's place
/// (kReferenceSubBits). depth_bits: rect.width * rect.height, row-major, holding +infinity or depths drawn before.
void depth_tile(const TileInput& input, uint32_t* depth_bits);

/// The name of the instruction set in use.
const char* kernel_target();

}  // namespace telesplat::splat
