#include "common/splat/flat/splat_table.h"

#include <algorithm>
#include <cmath>

namespace telesplat::splat {
namespace {

// Surfaces up to this slope against the screen resolve to the nearest centre: tan(75 degrees).
constexpr double kResolvedSlope = 3.73;

uint32_t bias_at(double r2, double growth) {
  return std::min(static_cast<uint32_t>(std::lround(growth * r2)), kMaxBias);
}

double contour_r2(const KernelTraits& kernel, double size) { return kernel.flat_contour_r2 * size * size; }

// Fills the addend of each pixel of the splat's square, for a centre at (cx, cy) from the square's upper left corner.
void fill_addends(const KernelTraits& kernel, const FlatSplat& flat, double cx, double cy, int row_stride,
                  uint64_t* out) {
  const double contour = contour_r2(kernel, flat.size), radius2 = 0.25 * flat.size * flat.size;
  const int nearest_x = static_cast<int>(cx), nearest_y = static_cast<int>(cy);
  for (int y = 0; y < flat.side; ++y)
    for (int x = 0; x < flat.side; ++x) {
      const double dx = x + 0.5 - cx, dy = y + 0.5 - cy, r2 = dx * dx + dy * dy;
      const bool nearest = x == nearest_x && y == nearest_y;
      if (!nearest && kernel.flat_distance2(dx, dy) > radius2) continue;
      const uint64_t bias = bias_at(r2, flat.bias_growth), ring = ring_of(r2 / contour);
      out[y * row_stride + x] = bias << kKeyDepthBit | ring << kKeyRingBit;
    }
}

SplatShape build(const KernelTraits& kernel, const FlatSplat& flat) {
  SplatShape s;
  const int side = flat.side;
  s.side = side;
  if (side == 1) return s;
  s.sub_bits = flat.sub_bits;
  const int steps = 1 << s.sub_bits;
  s.scale = static_cast<float>(steps);
  s.shift = static_cast<float>(steps) * 0.5f * static_cast<float>(1 - side);
  s.row_stride = (side + 3) / 4 * 4;
  const size_t addends = static_cast<size_t>(side) * s.row_stride;
  s.addends.assign(static_cast<size_t>(steps) * steps * addends, kOutsideSplat);
  for (int sub = 0; sub < steps * steps; ++sub)
    fill_addends(kernel, flat, (sub % steps + 0.5) / steps + 0.5 * (side - 1),
                 (sub / steps + 0.5) / steps + 0.5 * (side - 1), s.row_stride, s.addends.data() + sub * addends);
  return s;
}

}  // namespace

float square_size(float splat_px) {
  return std::min(std::ceil(std::max(1.0f, splat_px) * 4.0f) * 0.25f, static_cast<float>(kMaxSplatSide));
}
float disc_diameter(float splat_px) { return square_size(splat_px); }
int square_side(float splat_px) { return static_cast<int>(std::ceil(square_size(splat_px))); }

int sub_bits(int side) {
  // Finer steps are invisible, and their tables would leave the first-level cache: 8 KiB at side 4, 32 KiB at 16.
  return side == 1 ? 0 : side <= 4 ? 3 : 2;
}

double splat_bias_growth(int side, double focal_px) {
  // Depth changes by `gradient` of itself from pixel to pixel on the steepest resolved slope. Centres a splat apart
  // then part their overlap within a quarter of a splat of the middle if k >= 2 gradient / side.
  const double gradient = kResolvedSlope / focal_px;
  const double cap = kMaxBias / (0.5 * side * side);  // kMaxBias in the square's corner
  return std::min(2.0 * gradient / side * (1 << 23) / (1 << kBiasShift), cap);
}

uint32_t splat_bias(double r2, int side, double focal_px) { return bias_at(r2, splat_bias_growth(side, focal_px)); }

FlatSplat flat_splat(const KernelTraits& kernel, float size, double focal_px) {
  const int side = static_cast<int>(std::ceil(size));
  const double growth = splat_bias_growth(side, focal_px);
  // A splat of one pixel has no contour apart from its centre.
  return {size, side, sub_bits(side), growth, side == 1 ? 0 : bias_at(contour_r2(kernel, size), growth)};
}

void SplatTable::set_focal(double focal_px) {
  if (focal_px == focal_px_) return;
  focal_px_ = focal_px;
  for (auto& kernel : shapes_)
    for (auto& shape : kernel) shape.reset();
}

const SplatShape& SplatTable::shape(const KernelTraits& kernel, const FlatSplat& flat) {
  auto& shape = shapes_[static_cast<size_t>(kernel.kernel)][static_cast<int>(flat.size * 4.0f)];
  if (!shape) shape = std::make_unique<SplatShape>(build(kernel, flat));
  return *shape;
}

}  // namespace telesplat::splat
