// Options of drawing and finishing splats, the same for both renderers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/splat/kernel_traits.h"

namespace telesplat::splat {

/// Per-pixel work after splatting. Each stage can be switched off; SplatStats has the time of each.
struct Finish {
  bool fill = true;       ///< pin-holes: pixels inside a surface that are empty or show something farther
  bool smooth = true;     ///< interpolates between magnified splats of one surface (KernelTraits::smoothed)
  bool antialias = true;  ///< silhouettes
};

/// "on", "off", or the active stages, as in "fill,antialias"; finish_named reads the text of finish_name.
std::string finish_name(const Finish& finish);
std::optional<Finish> finish_named(std::string_view name);
/// As a number, for tables: 1 fill, 2 smooth, 4 antialias, added up. finish_of_bits reads the number of finish_bits;
/// nothing for other numbers.
unsigned finish_bits(const Finish& finish);
std::optional<Finish> finish_of_bits(uint64_t bits);

struct RenderOptions {
  Kernel kernel = Kernel::kDisc;
  Finish finish;
  /// CpuSplatter::render draws half as many pixels a side and doubles them. The points must be selected for
  /// geometry::half_size(camera).
  bool halved = false;
};

}  // namespace telesplat::splat
