// Constants and figures of whole items for the kernels `ellipse` and `ewa`: the place of a sample's footprint on the
// screen, and its pixels. surfel-inl.h has the work for each point.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "common/geometry/camera.h"
#include "common/splat/flat/splat_table.h"
#include "common/splat/pixel_key.h"

namespace telesplat::splat {

/// Cosine below which a sample's footprint no longer grows with the slope at which it was taken. Without a limit,
/// splats of samples taken at silhouettes would reach far beyond them.
inline constexpr float kMinSampledCosine = 0.35f;
/// Steepest surface, as the tangent of its angle to the screen, whose depth is followed across a splat: tan(78
/// degrees). For steeper ones, normals of 16 bits are too coarse to give the depth.
inline constexpr float kSteepest = 4.7f;
/// Largest footprint radius over distance: larger splats are cut to their largest size on the screen anyway, and no
/// product overflows.
inline constexpr float kMaxRadiusOverDepth = 1.0f;

/// The camera figures that contours need. Camera axes: X right, Y down, Z forward; a point w (u, v, 1) lies at pixel
/// (focal_x u + centre_x, focal_y v + centre_y).
struct SurfelCamera {
  float focal_x = 1, focal_y = 1, centre_x = 0, centre_y = 0;
  float step_x = 1, step_y = 1;                     ///< 1 / focal
  std::array<float, 3> right{}, down{}, forward{};  ///< the axes in room space
};

inline SurfelCamera surfel_camera(const geometry::Camera& c) {
  const glm::dmat4 v = c.view();
  const auto axis = [&](int i, double sign) {
    return std::array{static_cast<float>(sign * v[0][i]), static_cast<float>(sign * v[1][i]),
                      static_cast<float>(sign * v[2][i])};
  };
  return {static_cast<float>(c.focal_x()),
          static_cast<float>(c.focal_y()),
          static_cast<float>(-c.left * c.focal_x()),
          static_cast<float>(c.top * c.focal_y()),
          static_cast<float>(1.0 / c.focal_x()),
          static_cast<float>(1.0 / c.focal_y()),
          axis(0, 1),
          axis(1, -1),
          axis(2, -1)};
}

/// Source of an item's samples: the radius of the circle that each represents if the surface faces the sampling view,
/// and the direction to that view, unit length, in camera axes.
struct SurfelSource {
  float radius_m = 0;
  std::array<float, 3> to_eye{0, 0, -1};
};

inline float dot(const std::array<float, 3>& a, float x, float y, float z) { return (a[0] * x + a[1] * y) + a[2] * z; }

inline SurfelSource surfel_source(const SurfelCamera& c, float radius_m, const glm::vec3& to_eye_room) {
  const float x = to_eye_room.x, y = to_eye_room.y, z = to_eye_room.z;
  return {radius_m, {dot(c.right, x, y, z), dot(c.down, x, y, z), dot(c.forward, x, y, z)}};
}

/// Normal of 16 bits (image/normal.h) without its division and square root: 127 |x| + ... = 127, so coordinates are
/// whole numbers.
inline std::array<float, 3> surfel_normal(uint16_t code) {
  const float x = std::min(static_cast<float>(code & 255) - 127.0f, 127.0f),
              y = std::min(static_cast<float>(code >> 8) - 127.0f, 127.0f);
  const float z = (127.0f - std::abs(x)) - std::abs(y), fold = std::max(-z, 0.0f);
  return {x - std::copysign(fold, x), y - std::copysign(fold, y), z};
}

/// Low-pass of an opaque ellipse, squared pixels: S' = S + this. At equal sampling and display resolution the contour
/// still ends before the next sample; where samples crowd, each still reaches about a third of a pixel.
inline constexpr float kOpaqueVariance = 0.1f;
/// Bias on the contour, as a multiple of radius over depth, and its bounds, as shares of depth.
inline constexpr float kBiasPerRadius = 1.5f, kLeastBias = 1.0f / 2048, kMostBias = 0.005f;

/// Support of ewa's kernel: V = kFilterVariance I + max(1, kSupportGrowth - kSupportDrop / sqrt(det S)) S. A pixel at
/// offset d from the ellipse's centre has the weight (1 - d^T V^-1 d)^4 inside, a Gaussian of variance V / 8 cut
/// smoothly where it would be below 0.02, divided by det V: samples taken more densely count more. It is narrow where
/// samples lie a pixel apart, so that each pixel shows its own sample, and reaches over the neighbours where they are
/// magnified. V contains S', and every pixel's corner from its centre.
inline constexpr float kFilterVariance = 0.51f, kSupportGrowth = 2.5f, kSupportDrop = 0.85f;
/// Depth behind the visible surface within which a splat still counts, as a multiple of radius over depth, and its
/// bounds, as shares of depth.
inline constexpr float kEpsilonPerRadius = 2.0f, kLeastEpsilon = 1.0f / 512, kMostEpsilon = 1.0f / 32;

/// Change of the depth code as depth changes by its own size: 2^14 times the mantissa of w, in [1, 2).
inline float codes_per_depth(float w) {
  return std::bit_cast<float>((std::bit_cast<uint32_t>(w) & 0x007fffffu) | 0x46800000u);
}

/// share of depth = clamp(factor * radius / w, least, most), in depth codes.
inline float surfel_share(float radius_m, float w, float factor, float least, float most) {
  return codes_per_depth(w) * std::clamp(factor * std::min(radius_m / w, kMaxRadiusOverDepth), least, most);
}

/// Largest distance of a contour in the image from its splat's centre, in pixels, as a multiple of radius over depth
/// (unless it exceeds kMaxSplatSide): the footprint stretched most, where perspective stretches most; plus a tenth for
/// its centre's offset.
inline float widest_contour(const geometry::Camera& c) {
  const double u = std::max(std::abs(c.left), std::abs(c.right)), v = std::max(std::abs(c.top), std::abs(c.bottom));
  const double stretch2 = 1.0 + 1.0 / (kMinSampledCosine * kMinSampledCosine);
  return static_cast<float>(1.1 * std::max(c.focal_x(), c.focal_y()) * std::sqrt((1.0 + u * u + v * v) * stretch2));
}

/// The bias of an ellipse on its contour, in depth codes.
inline float ellipse_bias(float radius_m, float w) {
  return std::min(surfel_share(radius_m, w, kBiasPerRadius, kLeastBias, kMostBias), static_cast<float>(kMaxBias));
}

/// Limits of det S = radius^4: it reaches as many as the spacing_class of the samples' mean distance on the screen.
///   scale: DrawList::scale of the drawn splats: their radius is scale / 2 distances.
using SpacingLimits = std::array<float, 3>;
inline SpacingLimits spacing_limits(float scale) {
  const auto limit = [&](float spacing_px) {
    const float r = 0.5f * scale * spacing_px;
    return (r * r) * (r * r);
  };
  return {limit(1.3f), limit(1.8f), limit(3.0f)};
}

}  // namespace telesplat::splat
