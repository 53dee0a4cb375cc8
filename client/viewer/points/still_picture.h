// The picture of a camera that rests, refined tile by tile: keeps the tiles and their pixels, and chooses the next one.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "client/viewer/points/model_cache.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A tile has one of three states: to be drawn; drawn, with pixels of its own; left alone, because its points are no
/// finer than pixels. If points come or go in a tile, it is to be drawn again, and keeps its pixels until then. Times
/// come as arguments; no clocks, no renderer.
class StillPicture {
 public:
  static constexpr int kTileWidth = 128, kTileHeight = 96;  ///< pixels
  /// Time before a tile that was drawn or left alone is looked at again: points come in many small patches.
  static constexpr double kTileRest_s = 0.25;

  /// Begins for another camera: all tiles are to be drawn, and have no pixels.
  void begin(const geometry::Camera& camera);
  /// Marks tiles in which points came or went as to be drawn. Another replica may be another scene: all begins anew.
  void on_changes(const ModelCache::Changes& changes);
  /// Marks tiles that these rectangles of the picture touch.
  void on_changes(std::span<const geometry::Rect> rects);

  /// Returns the next tile to draw: those without pixels first, from the centre outwards; then those that waited
  /// longest.
  std::optional<size_t> next(double now_s) const;
  geometry::Rect rect(size_t tile) const { return tiles_[tile].rect; }
  /// Returns the place of the tile's upper left pixel; rows are camera.width apart.
  uint32_t* pixels(size_t tile);
  /// has_pixels: it was drawn; else it is left alone, even if it had pixels before.
  void done(size_t tile, bool has_pixels, double now_s);

  /// Puts the tiles' pixels over a picture of the camera's size.
  void put_over(image::View& picture) const;
  void put_over(image::View& picture, size_t tile) const;
  /// Share of the picture's pixels that come from tiles.
  double share() const;
  /// True if tiles cover the whole picture.
  bool covers_all() const { return covered_ == tiles_.size(); }

 private:
  struct Tile {
    geometry::Rect rect;
    double distance = 0;  // distance of its centre from the picture's, pixels
    double done_s = -1e9;
    bool wanted = true, has_pixels = false;
  };
  void want(const geometry::Camera::PixelTransform& to_pixel, const geometry::Box& box);
  void want(int x0, int y0, int x1, int y1);

  geometry::Camera camera_;
  int columns_ = 0;
  std::vector<Tile> tiles_;  // ordered by rows
  size_t covered_ = 0;       // tiles that have pixels
  std::vector<uint32_t> colour_;
};

}  // namespace telesplat::viewer
