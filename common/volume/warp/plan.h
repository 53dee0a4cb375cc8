// Plans the warp before the first pixel: the places of display pixels, and the parts of a tile that each layer fills.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/warp/kernels.h"
#include "common/volume/warp/warper.h"

namespace telesplat::volume {

/// Display pixels numbered from the point straight ahead instead of from a corner, so that a part of a view
/// (geometry::crop) has the same numbers, and then to the bit the same rays, as the whole. Along one side: pixel i has
/// its centre at tangent (first + i + 0.5 + offset) * pitch.
struct PixelLattice {
  int64_t first = 0;  ///< number of pixel 0
  double offset = 0;  ///< about [-0.5, 1), in steps of 2^-12
  double pitch = 1;   ///< rounded to 36 bits, since crop() computes it anew

  /// lo: the tangent at the begin of pixel 0; hi: at the end of the last of `pixels`. hi > lo.
  static PixelLattice make(double lo, double hi, int pixels);
};

/// A layer, and the map from display pixels to its texels.
struct PlacedLayer {
  const LayerImage* image;
  /// (X, Y, W) = column i . (x, y, 1): the ray through continuous pixel position (x, y) meets texel (X / W, Y / W) of
  /// the image (whole numbers are texels' centres) if W > 0. Columns, not rows: to_texel[0] gives X.
  glm::dmat3 to_texel;
  double depth;  ///< over W: distance along -z, metres
};
/// The layers of a frame that the camera's rays may meet, in front_to_back order. image points into frame.
std::vector<PlacedLayer> place_layers(const VolumeFrame& frame, const geometry::Camera& camera);

/// The plan of one display image, used by all its tiles.
class WarpPlan {
 public:
  /// Precondition: frame outlives the plan.
  WarpPlan(const VolumeFrame& frame, const geometry::Camera& camera);

  size_t layers() const { return layers_.size(); }
  /// Tiles begin at multiples of their size on the lattice.
  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }

  /// Display pixels of tile (tx, ty).
  geometry::Rect rect(int tx, int ty) const;
  /// Sets layers, parts and the range of pixels; tile.layers then points into `layers`.
  void place(int tx, int ty, WarpTile& tile, std::vector<WarpLayer>& layers) const;

 private:
  struct Placing;
  bool place(const PlacedLayer& layer, int64_t x, int64_t y, uint64_t bit, WarpTile& tile, WarpLayer& out) const;

  PixelLattice across_, down_;
  int width_, height_;
  int tiles_x_, tiles_y_;
  std::vector<PlacedLayer> layers_;
};

}  // namespace telesplat::volume
