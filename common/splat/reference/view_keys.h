// The model as the packer sees it in a view, tile by tile: the surface of its splats, and the places of its points
// within the pixels. All level-0 points count, so no packed point is overlooked.
#pragma once

#include <functional>
#include <memory>
#include <span>

#include "common/points/point_model.h"
#include "common/splat/pixel_key.h"
#include "common/splat/tile_binning.h"

namespace telesplat::splat {

/// Sizes of splats as multiples of the distance of their samples. A square grid's splats meet at its diagonals from
/// sqrt 2 on: then a surface hides all that is behind it, even if thinly sampled (up to kMaxSplatSide pixels).
inline constexpr float kClosedScale = 1.45f;

class ViewKeys {
 public:
  /// Valid pixels around a tile, also outside the image.
  static constexpr int kReach = 2;

  struct Tile {
    int index = 0;
    geometry::Rect rect;  ///< in the view, inside the image
    bool empty = true;    ///< no point comes near: keys is null
    const uint64_t* keys = nullptr;
    int key_stride = 0;
    const uint32_t* depth_bits = nullptr;
    int depth_stride = 0;

    /// Keys (pixel_key.h) of row y, from pixel 0 of the tile on; -kReach <= y < height + kReach, x likewise.
    const uint64_t* key_row(int y) const { return keys + static_cast<ptrdiff_t>(y) * key_stride; }
    /// The nearest point in each pixel: depth_tile() in splat_kernels.h.
    const uint32_t* depth_row(int y) const { return depth_bits + static_cast<ptrdiff_t>(y) * depth_stride; }
  };

  /// threads: 0 = all cores.
  explicit ViewKeys(int threads);
  ~ViewKeys();

  /// Chooses and bins the points of a view. The model must not change until the last draw().
  /// tile_width, tile_height: multiples of 64 keep the bits of two tiles' pixels in different words.
  /// rests: points of heads at rest count, too.
  void begin(const points::PointModel& model, const geometry::Camera& camera, int tile_width, int tile_height,
             bool rests = false);
  const TileGrid& grid() const;
  /// Bias of the keys' depth codes, for unbiased_depth_code().
  const RimBias& rim() const;
  uint64_t points() const;

  /// Draws tiles and calls visit(tile) for each, several at a time on several threads; the tile's rows are valid during
  /// the call.
  void draw(std::span<const int> tiles, const std::function<void(const Tile&)>& visit);
  void draw_all(const std::function<void(const Tile&)>& visit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::splat
