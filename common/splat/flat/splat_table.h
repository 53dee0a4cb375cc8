// Splat shapes: the addends of a splat's pixels to its centre's key (pixel_key.h): a bias of the depth code that grows
// with the squared distance from the centre, and the ring. Adding steps to a depth code multiplies the depth by nearly
// a constant, so one integer a pixel does it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/splat/kernel_traits.h"
#include "common/splat/pixel_key.h"

namespace telesplat::splat {

inline constexpr int kMaxSplatSide = 16;
inline constexpr int kBiasShift = kDepthCodeShift;  ///< one bias step = 2^9 units of a float's last place

/// A flat splat of one size: the figures that both renderers use.
struct FlatSplat {
  float size = 1;          ///< side of a square, diameter of a disc, pixels: a multiple of 0.25, 1..kMaxSplatSide
  int side = 1;            ///< side of the pixel square that holds it for any centre, 1..kMaxSplatSide
  int sub_bits = 0;        ///< the projected centre's place in a pixel is known to 2^-sub_bits pixels on each axis
  double bias_growth = 0;  ///< splat_bias_growth
  uint32_t rim_bias = 0;   ///< bias on the contour, q = 1
};
/// size: square_size(). Precondition: the kernel is flat.
FlatSplat flat_splat(const KernelTraits& kernel, float size, double focal_px);

/// One kernel at one size, pixel by pixel.
struct SplatShape {
  int side = 1;      ///< as FlatSplat
  int sub_bits = 0;  ///< as FlatSplat
  float scale = 1;   ///< 2^sub_bits
  /// Added to the centre's position in 2^-sub_bits pixels: (1 - side) / 2 pixels. The square's first pixel is
  /// floor(x_pix + (1 - side) / 2), so that even sides cover the pixels nearest the centre.
  float shift = 0;
  int row_stride = 4;             ///< side rounded up to a multiple of 4
  std::vector<uint64_t> addends;  ///< [sub_y][sub_x][side][row_stride], padded with kOutsideSplat; empty if side == 1
};

/// Size of the square splat for a size in pixels, and diameter of the disc: rounded up to a multiple of 0.25,
/// 1..kMaxSplatSide.
float square_size(float splat_px);
float disc_diameter(float splat_px);
/// Side of the square of pixels that holds a square splat for any place of its centre.
int square_side(float splat_px);

/// The shapes of one view, built when first requested. The projected centre's place is known to 1/8 or, above 4 pixels,
/// 1/4 of a pixel (the middle of that step counts). A splat covers the pixel nearest to it and
///   square: the pixels whose centres lie within size / 2 of it on both axes; contour (q = 1): the circle through
///     its corners;
///   disc: the pixels whose centres lie within diameter / 2 of it; contour: that circle.
class SplatTable {
 public:
  /// focal_px sets the slope up to which neighbours resolve to the nearest centre. Drops shapes made for another focal
  /// length.
  void set_focal(double focal_px);
  /// flat: made by flat_splat() for this kernel and the focal length set last.
  const SplatShape& shape(const KernelTraits& kernel, const FlatSplat& flat);

 private:
  double focal_px_ = 0;
  std::unique_ptr<SplatShape> shapes_[kKernels.size()][kMaxSplatSide * 4 + 1];
};

/// For a splat of this side, the projected centre's place within a pixel is known to 2^-sub_bits pixels.
int sub_bits(int side);
/// The bias grows by this many steps a squared pixel; it ends at kMaxBias.
double splat_bias_growth(int side, double focal_px);
/// Bias in steps of 2^kBiasShift units of the last place, at squared distance r2 (pixels) from the centre of a splat.
uint32_t splat_bias(double r2, int side, double focal_px);

}  // namespace telesplat::splat
