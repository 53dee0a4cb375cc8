// One tile's pixels between splatting and writing, and what may work on them there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/splat/render_options.h"

namespace telesplat::splat {

struct SplatStats;

/// Keys, or pairs of colour and info once resolved (pixel_key.h), of a tile and of `reach` pixels around it, which are as valid as
/// its own: also beyond the image's edges.
struct TilePixels {
  uint64_t* pixels = nullptr;  ///< the tile's first
  int stride = 0;              ///< pixels from row to row
  int width = 0, height = 0;   ///< of the tile itself: it may be cut by the image's edge
  int reach = 0;

  /// x in -reach .. width + reach - 1, y likewise.
  uint64_t* at(int x, int y) const { return pixels + static_cast<ptrdiff_t>(y) * stride + x; }
};

/// What is the same for all tiles of a frame.
struct FinishFrame {
  float near_m = 0;         ///< what depth codes count from
  float focal_px = 0;       ///< focal_x
  uint32_t background = 0;  ///< 0x00RRGGBB
};

/// A stage of the finish: works on pairs in place, between resolving and writing. Stages run in the order they are listed.
struct FinishStage {
  bool Finish::*on;        ///< runs where this is set
  double SplatStats::*ms;  ///< its time goes here
  int reach;               ///< how far from a pixel the stage looks: that much of the tile's reach is used up by it
  /// tile.reach: what stays valid after this stage; the stage computes the tile and that much around it, and may read `reach`
  /// pixels farther. scratch: one a thread, kept from tile to tile, of any size and content.
  void (*run)(const TilePixels& tile, const FinishFrame& frame, std::vector<uint64_t>& scratch);
};

}  // namespace telesplat::splat
