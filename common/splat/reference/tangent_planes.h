// Continues the depth of a sample's tangent plane from its pixel to the pixels around it.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/splat/surfel/splat.h"

namespace telesplat::splat {

/// Slopes of a plane whose depth at an offset of (dx, dy) pixels is depth * (1 + x dx + y dy).
struct PlaneSlope {
  float x, y;
};

/// Slopes are limited to those that splats follow (surfel/splat.h): steeper ones are beyond the precision of normals.
class TangentPlanes {
 public:
  explicit TangentPlanes(const geometry::Camera& camera) : c_(surfel_camera(camera)) {}
  /// normal: 16 bits, of a sample at the centre of pixel (x, y).
  PlaneSlope at(uint16_t normal, int x, int y) const {
    const auto [nx, ny, nz] = surfel_normal(normal);
    const float mx = dot(c_.right, nx, ny, nz), my = dot(c_.down, nx, ny, nz), mz = dot(c_.forward, nx, ny, nz);
    const float u = (static_cast<float>(x) + 0.5f - c_.centre_x) * c_.step_x,
                v = (static_cast<float>(y) + 0.5f - c_.centre_y) * c_.step_y;
    const float along = (mx * u + my * v) + mz;
    const float inverse = 1.0f / std::copysign(std::max(std::abs(along), 1e-3f), along);
    const float limit_x = kSteepest * c_.step_x, limit_y = kSteepest * c_.step_y;
    return {-std::clamp(mx * inverse * c_.step_x, -limit_x, limit_x),
            -std::clamp(my * inverse * c_.step_y, -limit_y, limit_y)};
  }

 private:
  SurfelCamera c_;
};

}  // namespace telesplat::splat
