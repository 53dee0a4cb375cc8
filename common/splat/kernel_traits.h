// The splat kernels. One row of a table has all that the program must know of a kernel: both renderers, the flags, the
// window and `telesplat compare` read it. Rows are read once a frame or once an item, never once a point.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::splat {

/// Footprint of a point on the screen.
enum class Kernel {
  kSquare,   ///< a square of pixels; one pass, opaque
  kDisc,     ///< a circle on the screen; one pass, opaque
  kEllipse,  ///< the sample's disc on the surface, projected exactly (T4.4.1, eq. 4.2-4.7); one pass, opaque
  kEwa,  ///< the same contour as a Gaussian: visibility with an epsilon, then weighted accumulation and normalisation
};
inline constexpr std::array kKernels{Kernel::kSquare, Kernel::kDisc, Kernel::kEllipse, Kernel::kEwa};

/// Passes that turn splats into pixels.
enum class Passes {
  kKeys,  ///< one pass: splats are opaque, and each pixel keeps its least key (pixel_key.h)
  kSums,  ///< two passes: the depth of opaque splats, then weighted sums of the visible ones; leaves shaded colours
};

/// A splat touches only pixels within growth * widest_contour() * radius over depth + least_px of its projected centre,
/// and within kMaxSplatSide. growth: the factor of the contour; least_px: the low-pass, and a pixel.
struct SurfelReach {
  float growth = 0, least_px = 0;
};

struct TileCounts;
struct TileWork;

struct KernelTraits {
  Kernel kernel;
  std::string_view name;  ///< in flags, records and captions
  char window_key;        ///< the key that chooses it in the window

  /// Scale factor of splat sizes (T eq. 4.8) that suits the kernel.
  float suitable_scale;
  /// True if the finish may interpolate between its splats: keys then carry the class of their spacing (spacing_class).
  bool smoothed;
  Passes passes;

  /// True: a splat is its sample's disc on the surface (DrawItem::radius_m and to_eye). False: it is flat, faces the
  /// screen and has the size DrawItem::splat_px.
  bool surfel;

  /// Flat: squared length of the offset (dx, dy), in the metric whose ball of radius size / 2 is the splat. Else null.
  double (*flat_distance2)(double dx, double dy) = nullptr;
  /// Flat: squared radius of the contour (the circle on which q = 1), as a share of the squared size.
  double flat_contour_r2 = 0;

  SurfelReach reach;  ///< surfels
  /// Surfels: bias of the depth code on the contour of a splat of this radius at this depth. Null: no bias.
  float (*surfel_bias)(float radius_m, float depth_m) = nullptr;

  /// The CPU splatter: its tiles in pixels, and the kernel inside one tile (tile_work.h).
  int tile_width, tile_height;
  TileCounts (*splat_tile)(const TileWork& work);
};

const KernelTraits& traits_of(Kernel kernel);

inline std::string_view kernel_name(Kernel kernel) { return traits_of(kernel).name; }
std::optional<Kernel> kernel_named(std::string_view name);
/// The kernel that a key of the window ('1' and so on) chooses.
std::optional<Kernel> kernel_of_key(char window_key);
/// All names, in the order of the table.
const std::vector<std::string>& kernel_names();
/// All names for a help text: "square, disc, ellipse or ewa".
std::string kernel_list();

/// Splats suit best if they are about as large as the distance of their samples: larger ones blur and grow silhouettes.
/// The remaining gaps are pin-holes, which the finish fills. Set by comparing frames along walk-around-a.csv at
/// 2560x1600: on a head, discs of 1.5 without finish 31.9 dB, ellipses of 1.0 with finish 36.3 dB.
inline float suitable_scale(Kernel kernel) { return traits_of(kernel).suitable_scale; }

}  // namespace telesplat::splat
