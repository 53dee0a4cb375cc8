// The finish: what happens to a tile's resolved pixels before they are shown. Each stage is optional and works inside
// the tile, while it is in the cache. Every SIMD target computes the same pixels.
//
// Two pixels belong to different surfaces if their depth codes (pixel_key.h: 2^14 steps an octave) differ by more than
// kEdge, about 2 % of depth. An empty pixel counts as farther than everything.
//
// Fill (pin-holes): the depth map is closed with a 3x3 window:
//     closed(p) = max over the 3x3 pixels q around p of (min over the 3x3 pixels around q of the code).
//   A pixel is a hole if its code exceeds closed(p) by more than kEdge. If at least kFillSupports of its 8 neighbours
//   lie within kEdge of closed(p), its colour and depth become the means of those neighbours; the four at its sides
//   count twice. So gaps of up to two pixels are closed, also those through which something farther shows. Surfaces
//   grow nowhere outwards: closing leaves a pixel open if a 3x3 window around it fits into the gap.
//   This is pull-push, after Grossman and Dally 1998, with one level and a sliding window instead of a pyramid: coarser
//   levels bleed over silhouettes. Gathering along the four axes up to 3 pixels away gave 20.0, 36.4 and 36.4 dB where
//   this gives 20.6, 36.5 and 36.2, and took about four times as long.
// Smooth: interpolates the samples of magnified splats, along rows and then along columns. The weights are [1 2 1] / 4
//   where the spacing class is 2 or more (exactly bilinear interpolation for samples 2 pixels apart) and [1 6 1] / 8
//   where it is 1. A neighbour of another surface counts as the pixel itself.
// Antialias: where the codes of the 3x3 pixels around a pixel range over more than 2 kEdge, its colour becomes their
//   mean with weights [1 2 1] x [1 2 1] / 16.
#pragma once

#include <cstdint>
#include <vector>

#include "common/splat/pixel_key.h"
#include "common/splat/render_options.h"

namespace telesplat::splat {

inline constexpr uint32_t kEdge = 480;  ///< depth codes: 1.5 to 2.9 % of depth
inline constexpr int kFillReach = 2;    ///< pixels
inline constexpr int kFillSupports = 4;
inline constexpr int kFinishSlack = 16;  ///< pixels that vectors may read and write beyond what a stage asks for

/// How many pixels around a tile must be valid for the stages that are on.
constexpr int finish_reach(const Finish& f) {
  return (f.fill ? kFillReach : 0) + (f.smooth ? 1 : 0) + (f.antialias ? 1 : 0);
}

/// Resolved pixels of a tile and of a margin around it, row by row: `stride` colours (0x00RRGGBB), then `stride` infos
/// (depth code << 8 | spacing class << 3 | ring; 0xffffffff: empty).
struct ResolvedTile {
  uint32_t* rows = nullptr;  ///< aligned as uint64_t; (height + 2 margin) rows of 2 stride
  int stride = 0;            ///< at least width + 2 margin
  int margin = 0;            ///< at least finish_reach() + kFinishSlack if any stage is on
  int width = 0, height = 0;

  /// Pixel x = 0 of row y; x in -margin..stride - margin - 1, y in -margin..height + margin - 1. Before the row is
  /// resolved, its keys (pixel_key.h) lie where its colours and infos will be.
  uint64_t* key(int y) const {
    return reinterpret_cast<uint64_t*>(rows) + static_cast<size_t>(y + margin) * stride + margin;
  }
  uint32_t* colour(int y) const { return rows + static_cast<size_t>(y + margin) * 2 * stride + margin; }
  uint32_t* info(int y) const { return colour(y) + stride; }
};

/// The part of the tile in which a stage may change anything: pixels farther than kFillReach from all that is not empty
/// stay empty. Width or height 0: the tile is empty.
ResolvedTile crop_to_content(const ResolvedTile& tile, int reach);

/// Working memory of the stages, kept from tile to tile.
struct FinishScratch {
  struct Pixel {
    int x, y;
    uint32_t colour, info;
  };
  std::vector<Pixel> pixels;
  std::vector<uint32_t> rows;
};

/// Closes the pin-holes of the tile grown by `grow` pixels. Reads kFillReach pixels more. Returns how many it closed.
int fill_holes(const ResolvedTile& tile, int grow, FinishScratch& scratch);
/// Smooths the tile grown by `grow` pixels. Reads one pixel more.
void smooth(const ResolvedTile& tile, int grow, FinishScratch& scratch);
/// Antialiases the tile. Reads one pixel more.
void antialias(const ResolvedTile& tile, FinishScratch& scratch);

}  // namespace telesplat::splat
