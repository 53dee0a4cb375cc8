// How splats are drawn and finished: the same for both renderers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace telesplat::splat {

/// Footprint of a point on the screen.
enum class Kernel {
  kSquare,   ///< a square of pixels; one pass, opaque
  kDisc,     ///< a circle on the screen; one pass, opaque
  kEllipse,  ///< the sample's disc on the surface, projected exactly (T4.4.1, eq. 4.2-4.7); one pass, opaque
  kEwa,  ///< the same contour as a Gaussian: visibility with an epsilon, then weighted accumulation and normalisation
};
inline constexpr std::array kKernels{Kernel::kSquare, Kernel::kDisc, Kernel::kEllipse, Kernel::kEwa};

constexpr std::string_view kernel_name(Kernel kernel) {
  constexpr std::string_view names[] = {"square", "disc", "ellipse", "ewa"};
  return names[static_cast<int>(kernel)];
}
constexpr std::optional<Kernel> kernel_named(std::string_view name) {
  for (const Kernel k : kKernels)
    if (kernel_name(k) == name) return k;
  return std::nullopt;
}

/// Scale factor of splat sizes (T eq. 4.8) that suits a kernel: splats about as large as their samples are apart, since larger ones blur
/// and grow silhouettes; what gaps that leaves is pin-holes, which the finish fills. Set by comparing frames along walk-around-a.csv at
/// 2560x1600: on a head, discs of 1.5 without finish 31.9 dB, ellipses of 1.0 with finish 36.3 dB.
constexpr float suitable_scale(Kernel kernel) {
  return kernel == Kernel::kSquare || kernel == Kernel::kDisc ? 1.1f : 1.0f;
}

/// Per-pixel work after splatting. Each stage can be switched off; SplatStats tells what each costs.
struct Finish {
  bool fill = true;       ///< pin-holes: pixels that show nothing, or something farther, amid a surface
  bool smooth = true;     ///< disc, ellipse: interpolates between magnified splats of one surface
  bool antialias = true;  ///< silhouettes
};

/// "on", "off", or the stages that are on, as in "fill,antialias"; finish_named reads what finish_name makes.
std::string finish_name(const Finish& finish);
std::optional<Finish> finish_named(std::string_view name);

struct RenderOptions {
  Kernel kernel = Kernel::kDisc;
  Finish finish;
};

}  // namespace telesplat::splat
