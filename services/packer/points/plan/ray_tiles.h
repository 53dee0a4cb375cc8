// A view's rays as tiles with masks: how plans carry them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/pixel_mask.h"
#include "common/wire/tile_messages.h"

namespace telesplat::packer {

/// Rays to be cast in a rectangle of a view.
struct RayTile {
  geometry::Rect rect;
  image::PixelMask mask;  ///< of rect's size
  uint64_t rays = 0;      ///< at least one
};

struct TileLimits {
  int size = 256;     ///< pixels: longest side; at least kLeastTile
  uint64_t rays = 0;  ///< a tile that is longer than kLeastTile has no more; 0: no limit
};
inline constexpr int kLeastTile = 32;

/// The part of a mask in a rectangle. Precondition: it lies in the mask.
image::PixelMask cropped(const image::PixelMask& mask, const geometry::Rect& rect);
/// Sets in `mask` what `part`, which lies at (x, y), has set.
void merge(const image::PixelMask& part, int x, int y, image::PixelMask& mask);

/// Cuts the part of a mask in `area`, which lies in it, into tiles: the box of its rays, halved across its longer side
/// while it is too long or has too many rays, so that about as many rays lie on either side; and each half likewise.
/// None has no rays.
std::vector<RayTile> cut_tiles(const image::PixelMask& mask, const geometry::Rect& area, const TileLimits& limits);

/// Takes from `cast` those of its rays in `some`, a part of it, that are farthest from the middle, by pieces of 64 x
/// 16 pixels, so that about `most` of them stay. Returns how many it took.
uint64_t put_off_rays(const image::PixelMask& some, uint64_t most, image::PixelMask& cast);

/// Those whose middle is nearest the middle of width x height pixels come first.
void sort_by_distance_to_centre(std::vector<RayTile>& tiles, int width, int height);

/// Adds the tiles to a plan, as many as messages allow. Returns how many.
size_t add_tiles(const std::vector<RayTile>& tiles, int threads, wire::Plan& plan);

}  // namespace telesplat::packer
