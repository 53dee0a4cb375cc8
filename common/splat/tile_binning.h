// Cuts the screen into tiles, and lists the boxes of a view that touch each. A tile's keys stay in a core's cache from
// splatting to the end of the finish, so only finished colours are written to memory.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/camera.h"

namespace telesplat::splat {

/// Tiles of equal size, row-major from the upper left; those at the right and lower edge may reach beyond the image.
struct TileGrid {
  int width = 0, height = 0;            ///< image, pixels
  int tile_width = 0, tile_height = 0;  ///< pixels

  int columns() const { return (width + tile_width - 1) / tile_width; }
  int rows() const { return (height + tile_height - 1) / tile_height; }
  int count() const { return columns() * rows(); }
  /// The part of tile `index` inside the image.
  geometry::Rect rect(int index) const;
};

/// Leaf coordinates (uint16 x, y, z) -> homogeneous pixels in single precision, dequantisation included: row . (x, y,
/// z, 1) = (x_pix w, y_pix w, w), w = depth in metres. Less than 0.01 pixel off on images of 16384 pixels.
struct LeafTransform {
  std::array<float, 4> x, y, w;
};
LeafTransform leaf_transform(const geometry::Camera::PixelTransform& room_to_pixel, const geometry::Box& leaf_room);

/// Lists of the boxes that touch each tile. The buffers are kept from one frame to the next.
class TileBinning {
 public:
  struct Entry {
    uint32_t box;  ///< index of the box
    /// 1: the box with its margin lies wholly inside the tile and beyond the near plane, so none of its points needs a
    /// test.
    uint32_t whole;
  };

  /// Conservative: a box is listed in every tile that any of its points, grown by margin_px to each side, can touch.
  ///   transforms: one for each box. Boxes wholly nearer than near_m or outside the image are listed nowhere.
  void build(const TileGrid& grid, std::span<const LeafTransform> transforms, float near_m, float margin_px);

  /// The same in three steps: begin(), place() for each box in any order and on any thread, list().
  ///   reach: a box's points at depth w touch reach / w pixels more to each side, most_px at most.
  void begin(const TileGrid& grid, size_t boxes, float near_m, float margin_px);
  void place(size_t box, const LeafTransform& transform, float reach = 0, float most_px = 0);
  void list();

  std::span<const Entry> tile(int index) const {
    return {entries_.data() + first_[index], entries_.data() + first_[index + 1]};
  }

 private:
  struct Range {
    int16_t column0, column1, row0, row1;  // inclusive; column1 < column0: in no tile
    bool whole;
  };
  TileGrid grid_;
  float near_m_ = 0, margin_px_ = 0;
  std::vector<Range> ranges_;
  std::vector<uint32_t> first_, next_;
  std::vector<Entry> entries_;
};

}  // namespace telesplat::splat
