#include "common/splat/kernel_traits.h"

#include <algorithm>
#include <cmath>

#include "common/splat/tile_work.h"

namespace telesplat::splat {
namespace {

double square_distance2(double dx, double dy) { return std::max(dx * dx, dy * dy); }
double disc_distance2(double dx, double dy) { return dx * dx + dy * dy; }

TileCounts splat_flat(const TileWork& w) { return splat_tile(w.input, w.styles, w.keys); }
TileCounts splat_ellipses(const TileWork& w) { return ellipse_tile(w.input, w.surfels, w.keys); }
TileCounts splat_ewa(const TileWork& w) { return ewa_tile(w.input, w.surfels, w.light, w.ewa, w.tile, w.reach); }

// Tile for kernels with keys. Set by bench splat_square, 3 pixels, one thread: 14.5 ms at 256 x 256, 13.3 ms here (384
// KiB keys, which leaves the second-level cache some room), 14.0 ms at 256 x 128, 15.1 ms at 128 x 128 (more clusters
// straddle tiles), 13.4 ms at 320 x 160.
constexpr int kTileWidth = 256, kTileHeight = 192;

// ewa keeps 36 bytes more a pixel. Points across borders cost more than the second-level cache gains: a million splats,
// 3 pixels each, took 62.6 ms at 96 x 96, 60.3 ms at 128 x 64, 56.7 ms at 128 x 96, 55.7 ms here.
constexpr int kEwaTileWidth = 192, kEwaTileHeight = 128;

constexpr KernelTraits kTable[] = {
    {.kernel = Kernel::kSquare,
     .name = "square",
     .window_key = '1',
     .suitable_scale = 1.1f,
     .smoothed = false,  // the fast kernel shows its samples plainly
     .passes = Passes::kKeys,
     .surfel = false,
     .flat_distance2 = square_distance2,
     .flat_contour_r2 = 0.5,  // the circle through its corners
     .tile_width = kTileWidth,
     .tile_height = kTileHeight,
     .splat_tile = splat_flat},
    {.kernel = Kernel::kDisc,
     .name = "disc",
     .window_key = '2',
     .suitable_scale = 1.1f,
     .smoothed = true,
     .passes = Passes::kKeys,
     .surfel = false,
     .flat_distance2 = disc_distance2,
     .flat_contour_r2 = 0.25,
     .tile_width = kTileWidth,
     .tile_height = kTileHeight,
     .splat_tile = splat_flat},
    {.kernel = Kernel::kEllipse,
     .name = "ellipse",
     .window_key = '3',
     .suitable_scale = 1.0f,
     .smoothed = true,
     .passes = Passes::kKeys,
     .surfel = true,
     .reach = kEllipseReach,
     .surfel_bias = ellipse_bias,
     .tile_width = kTileWidth,
     .tile_height = kTileHeight,
     .splat_tile = splat_ellipses},
    {.kernel = Kernel::kEwa,
     .name = "ewa",
     .window_key = '4',
     .suitable_scale = 1.0f,
     .smoothed = true,
     .passes = Passes::kSums,
     .surfel = true,
     .reach = kEwaReach,
     .tile_width = kEwaTileWidth,
     .tile_height = kEwaTileHeight,
     .splat_tile = splat_ewa},
};

constexpr bool rows_are_in_order() {
  for (size_t i = 0; i < kKernels.size(); ++i)
    if (kKernels[i] != Kernel(i) || kTable[i].kernel != Kernel(i)) return false;
  return std::size(kTable) == kKernels.size();
}
static_assert(rows_are_in_order());

}  // namespace

const KernelTraits& traits_of(Kernel kernel) { return kTable[static_cast<size_t>(kernel)]; }

std::optional<Kernel> kernel_named(std::string_view name) {
  for (const KernelTraits& row : kTable)
    if (row.name == name) return row.kernel;
  return std::nullopt;
}

std::optional<Kernel> kernel_of_key(char window_key) {
  for (const KernelTraits& row : kTable)
    if (row.window_key == window_key) return row.kernel;
  return std::nullopt;
}

const std::vector<std::string>& kernel_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const KernelTraits& row : kTable) out.emplace_back(row.name);
    return out;
  }();
  return names;
}

std::string kernel_list() {
  const auto& names = kernel_names();
  std::string out = names.front();
  for (size_t i = 1; i < names.size(); ++i) out.append(i + 1 < names.size() ? ", " : " or ").append(names[i]);
  return out;
}

}  // namespace telesplat::splat
