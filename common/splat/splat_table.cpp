#include "common/splat/splat_table.h"

#include <algorithm>
#include <cmath>

namespace telesplat::splat {
namespace {

// Surfaces up to this slope against the screen resolve to the nearest centre: tan(75 degrees).
constexpr double kResolvedSlope = 3.73;

SplatShape build(Kernel kernel, double size, double focal_px) {
  SplatShape s;
  const int side = static_cast<int>(std::ceil(size));
  s.side = side;
  if (side == 1) return s;
  s.sub_bits = sub_bits(side);
  const int steps = 1 << s.sub_bits;
  s.scale = static_cast<float>(steps);
  s.shift = static_cast<float>(steps) * 0.5f * static_cast<float>(1 - side);
  s.row_stride = (side + 3) / 4 * 4;
  s.addends.assign(static_cast<size_t>(steps) * steps * side * s.row_stride, kOutsideSplat);
  const bool disc = kernel == Kernel::kDisc;
  const double contour_r2 = (disc ? 0.25 : 0.5) * size * size;
  s.rim_bias = splat_bias(contour_r2, side, focal_px);
  const auto inside = [&](double dx, double dy) {
    return disc ? dx * dx + dy * dy <= contour_r2 : std::max(std::abs(dx), std::abs(dy)) <= 0.5 * size;
  };
  for (int sub = 0; sub < steps * steps; ++sub) {
    // The centre, from the square's upper left corner.
    const double cx = (sub % steps + 0.5) / steps + 0.5 * (side - 1),
                 cy = (sub / steps + 0.5) / steps + 0.5 * (side - 1);
    const int nearest_x = static_cast<int>(cx), nearest_y = static_cast<int>(cy);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const double dx = x + 0.5 - cx, dy = y + 0.5 - cy, r2 = dx * dx + dy * dy;
        if (!inside(dx, dy) && !(x == nearest_x && y == nearest_y)) continue;
        const uint64_t bias = splat_bias(r2, side, focal_px), ring = ring_of(r2 / contour_r2);
        s.addends[(static_cast<size_t>(sub) * side + y) * s.row_stride + x] = bias << kKeyDepthBit | ring
                                                                                                         << kKeyRingBit;
      }
  }
  return s;
}

}  // namespace

float square_size(float splat_px) {
  return std::min(std::ceil(std::max(1.0f, splat_px) * 4.0f) * 0.25f, static_cast<float>(kMaxSplatSide));
}
float disc_diameter(float splat_px) { return square_size(splat_px); }
int square_side(float splat_px) { return static_cast<int>(std::ceil(square_size(splat_px))); }

int sub_bits(int side) {
  // Finer steps are not seen, but finer tables would leave the first-level cache: 8 KiB at side 4, 32 KiB at side 16.
  return side == 1 ? 0 : side <= 4 ? 3 : 2;
}

double splat_bias_growth(int side, double focal_px) {
  // Depth changes by `gradient` of itself from pixel to pixel on the steepest resolved slope. Centres a splat apart then part
  // their overlap within a quarter of a splat of the middle if k >= 2 gradient / side.
  const double gradient = kResolvedSlope / focal_px;
  const double cap = kMaxBias / (0.5 * side * side);  // kMaxBias in the square's corner
  return std::min(2.0 * gradient / side * (1 << 23) / (1 << kBiasShift), cap);
}

uint32_t splat_bias(double r2, int side, double focal_px) {
  return std::min(static_cast<uint32_t>(std::lround(splat_bias_growth(side, focal_px) * r2)), kMaxBias);
}

void SplatTable::set_focal(double focal_px) {
  if (focal_px == focal_px_) return;
  focal_px_ = focal_px;
  for (auto& kernel : shapes_)
    for (auto& shape : kernel) shape.reset();
}

const SplatShape& SplatTable::shape(Kernel kernel, float splat_px) {
  const float size = square_size(splat_px);
  auto& shape = shapes_[kernel == Kernel::kDisc][static_cast<int>(size * 4.0f)];
  if (!shape) shape = std::make_unique<SplatShape>(build(kernel, size, focal_px_));
  return *shape;
}

}  // namespace telesplat::splat
