// How the kernels `ellipse` and `ewa` turn a contour (contour.h) into pixels: constants and plain functions.
// surfel-inl.h, ellipse-inl.h and ewa-inl.h do the same operations in the same order on vectors.
#pragma once

#include <bit>

#include "common/splat/flat/splat_table.h"
#include "common/splat/pixel_key.h"
#include "common/splat/surfel/contour.h"

namespace telesplat::splat {

/// Low-pass of an opaque ellipse, squared pixels: S' = S + this. At equal sampling and display resolution the contour
/// then still ends before the next sample; where samples crowd, each still reaches about a third of a pixel.
inline constexpr float kOpaqueVariance = 0.1f;
/// Bias on the contour, as a multiple of radius over depth, and its bounds, as shares of depth.
inline constexpr float kBiasPerRadius = 1.5f, kLeastBias = 1.0f / 2048, kMostBias = 0.005f;

/// Support of ewa's kernel: V = kFilterVariance I + max(1, kSupportGrowth - kSupportDrop / sqrt(det S)) S. The weight
/// of a pixel at offset d from the ellipse's centre is (1 - d^T V^-1 d)^4 inside, a Gaussian of variance V / 8 cut
/// smoothly where it would be below 0.02, divided by det V: samples taken more densely count more. It is narrow where
/// samples lie a pixel apart, so that each pixel shows its own sample, and reaches over the neighbours where they are
/// magnified. V contains S', and every pixel's corner from its centre.
inline constexpr float kFilterVariance = 0.51f, kSupportGrowth = 2.5f, kSupportDrop = 0.85f;
/// How far behind the visible surface a splat still counts, as a multiple of radius over depth, and its bounds, as
/// shares of depth.
inline constexpr float kEpsilonPerRadius = 2.0f, kLeastEpsilon = 1.0f / 512, kMostEpsilon = 1.0f / 32;

/// Depth codes before rounding: 2^14 an octave, linear inside it.
inline float depth_code(float w, float near_m) {
  const auto bits = static_cast<int32_t>(std::bit_cast<uint32_t>(w) - std::bit_cast<uint32_t>(near_m));
  return static_cast<float>(bits) * (1.0f / (1 << kDepthCodeShift));
}
/// Change of the depth code as depth changes by its own size: 2^14 times the mantissa of w, in [1, 2).
inline float codes_per_depth(float w) {
  return std::bit_cast<float>((std::bit_cast<uint32_t>(w) & 0x007fffffu) | 0x46800000u);
}

/// d^T S^-1 d = dx (xx dx + xy dy) + yy dy dy about (centre_x, centre_y), in pixels of the image.
struct SurfelConic {
  float centre_x = 0, centre_y = 0;
  float xx = 0, xy = 0, yy = 0;
  /// Pixels whose centres lie in its box, [x0, x1) x [y0, y1), cut to kMaxSplatSide.
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  float determinant = 0;  ///< of S

  float at(float dx, float dy) const { return dx * (xx * dx + xy * dy) + (yy * dy) * dy; }
};

/// The conic of grow S + add I.
inline SurfelConic surfel_conic(const SurfelContour& c, float x_pix, float y_pix, float grow, float add) {
  SurfelConic out;
  constexpr int kHalf = kMaxSplatSide / 2;
  // No farther than binning allows for.
  constexpr float kFarthest = kHalf - 1;
  out.centre_x = x_pix + std::clamp(c.offset_x, -kFarthest, kFarthest);
  out.centre_y = y_pix + std::clamp(c.offset_y, -kFarthest, kFarthest);
  const float xx = grow * c.xx + add, xy = grow * c.xy, yy = grow * c.yy + add;
  out.determinant = xx * yy - xy * xy;
  const float inverse = 1.0f / out.determinant;
  out.xx = yy * inverse, out.xy = (xy * -2.0f) * inverse, out.yy = xx * inverse;
  const auto bounds = [](float centre, float reach, int& first, int& last) {
    const int pixel = static_cast<int>(std::floor(centre));
    const float from = centre - 0.5f;
    first = std::max(static_cast<int>(std::ceil(from - reach)), pixel - (kHalf - 1));
    last = std::min(static_cast<int>(std::floor(from + reach)) + 1, pixel + kHalf + 1);
  };
  bounds(out.centre_x, std::sqrt(xx), out.x0, out.x1);
  bounds(out.centre_y, std::sqrt(yy), out.y0, out.y1);
  return out;
}

/// The depth code across a splat: centre + x dx + y dy, offsets from the conic's centre.
struct SurfelDepth {
  float centre = 0, x = 0, y = 0;
};
inline SurfelDepth surfel_depth(const SurfelContour& c, float w, float near_m) {
  const float scale = -codes_per_depth(w);
  const float x = scale * c.slope_x, y = scale * c.slope_y;
  return {(depth_code(w, near_m) + x * c.offset_x) + y * c.offset_y, x, y};
}

/// share of depth = clamp(factor * radius / w, least, most), in depth codes.
inline float surfel_share(float radius_m, float w, float factor, float least, float most) {
  return codes_per_depth(w) * std::clamp(factor * std::min(radius_m / w, kMaxRadiusOverDepth), least, most);
}

/// No contour in the image reaches farther from its splat's centre than this times radius over depth, in pixels (unless
/// it reaches farther than kMaxSplatSide): the footprint stretched most, where perspective stretches most; a tenth for
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

/// Factor of S in ewa's support, from det S = radius^4.
inline float ewa_growth(float determinant_of_s) {
  return std::max(kSupportGrowth - kSupportDrop / std::sqrt(std::max(determinant_of_s, 1e-12f)), 1.0f);
}

/// spacing_class of the samples' mean distance on the screen, by det S = radius^4: how many of these limits it reaches.
///   scale: that splats were drawn with (DrawList::scale): their radius is scale / 2 distances.
using SpacingLimits = std::array<float, 3>;
inline SpacingLimits spacing_limits(float scale) {
  const auto limit = [&](float spacing_px) {
    const float r = 0.5f * scale * spacing_px;
    return (r * r) * (r * r);
  };
  return {limit(1.3f), limit(1.8f), limit(3.0f)};
}
inline uint32_t surfel_spacing(float determinant_of_s, const SpacingLimits& limits) {
  return (determinant_of_s >= limits[0]) + (determinant_of_s >= limits[1]) + (determinant_of_s >= limits[2]);
}

/// ewa: weight in the splat's centre.
inline float ewa_peak(float determinant_of_v) { return 1.0f / std::min(determinant_of_v, 1e6f); }

}  // namespace telesplat::splat
