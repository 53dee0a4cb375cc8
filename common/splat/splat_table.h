// Splat shapes: what a splat adds to its centre's depth|colour key in each pixel it covers.
//
// A key is (0x80000000 | bits of the depth as float) << 32 | albedo-times-light; the least key wins a pixel, and positive floats
// are ordered as their bits are. A pixel at distance r from the splat's centre gets the depth  z (1 + k r^2): where splats of one
// surface overlap the nearest centre wins, not the nearest depth, so that generous splats do not blur.
// Based on: M. Schuetz, M. Wimmer, "High-quality point-based rendering using fast single-pass interpolation", 2015 (paraboloids).
// Adding a constant to a float's bits multiplies the float by nearly a constant, so one integer a pixel does it. The bias is
// noted in the key's top colour byte too, in kBiasUnit steps, and taken off again where depth is written.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/splat/cpu_splatter.h"

namespace telesplat::splat {

inline constexpr int kMaxSplatSide = 16;
inline constexpr int kBiasShift = 8;                   ///< one bias step = 2^8 units of a float's last place
inline constexpr uint32_t kMaxBias = 163;              ///< 163 * 2^8 / 2^23 = 0.5 % of depth at most
inline constexpr uint64_t kOutsideSplat = 1ull << 63;  ///< turns a key's sign: larger than every key, as signed numbers
inline constexpr int64_t kEmptyKey = -1;               ///< nothing there: larger than every key

/// One kernel at one size.
struct SplatShape {
  int side = 1;      ///< the square of pixels that it is cut from, 1..kMaxSplatSide
  int sub_bits = 0;  ///< the projected centre's place within a pixel is told to 2^-sub_bits pixels on each axis
  float scale = 1;   ///< 2^sub_bits
  float shift =
      0;  ///< added to the centre's position in 2^-sub_bits pixels: (1 - side) / 2 pixels. The square's first pixel is
          ///< floor(x_pix + (1 - side) / 2), so that even sides cover the pixels nearest the centre
  int row_stride = 4;             ///< side rounded up to a multiple of 4
  std::vector<uint64_t> addends;  ///< [sub_y][sub_x][side][row_stride], padded with kOutsideSplat; empty if side == 1
};

/// Side of the square splat for a size in pixels: rounded up above a fraction of 0.2, so that neither cracks nor blur win.
int square_side(float splat_px);
/// Diameter of the disc for a size in pixels, rounded up to a multiple of 0.25.
float disc_diameter(float splat_px);

/// The shapes of one view, built when first asked for. A disc covers the pixels whose centres are within its radius of the
/// projected centre (told to 1/8 or, above 4 pixels, 1/4 of a pixel), and always the pixel nearest to it.
class SplatTable {
 public:
  /// focal_px sets the slope up to which neighbours resolve to the nearest centre. Drops shapes made for another focal length.
  void set_focal(double focal_px);
  const SplatShape& shape(Kernel kernel, float splat_px);

 private:
  double focal_px_ = 0;
  std::unique_ptr<SplatShape> shapes_[2][kMaxSplatSide * 4 + 1];
};

/// The projected centre's place within a pixel is told to 2^-sub_bits pixels, for a splat of this side.
int sub_bits(int side);
/// The bias grows by this many steps a squared pixel; it ends at kMaxBias.
double splat_bias_growth(int side, double focal_px);
/// Bias in steps of 2^kBiasShift units of the last place, at squared distance r2 (pixels) from the centre of a splat.
uint32_t splat_bias(double r2, int side, double focal_px);

}  // namespace telesplat::splat
