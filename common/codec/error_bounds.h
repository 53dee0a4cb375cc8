// How far a decoded depth image may be from the encoded one.
#pragma once

#include <cstdint>

namespace telesplat::codec {

/// Bounds that hold in every covered pixel. Which pixels are covered is always exact.
struct ErrorBounds {
  /// In 2^-32: |code - decoded code| <= depth / 2^32 * decoded code. A depth in metres is the reciprocal of its code,
  /// so that it is wrong by at most that share of itself. 0 is exact, and less than kLeastDepth is taken for 0.
  uint32_t depth = 0;
  int normal = 0;  ///< codes of each coordinate on the octahedron's map, turned as suits a tile; 0..kMostNormal
  int colour = 0;  ///< of each channel; 0..kMostColour

  static constexpr uint32_t kLeastDepth = 1u << 14;  ///< a 262144th: below it nearly all codes would be exact
  static constexpr uint32_t kMostDepth = 1u << 28;   ///< a sixteenth
  static constexpr int kMostNormal = 3, kMostColour = 15;

  bool exact() const { return depth < kLeastDepth && normal == 0 && colour == 0; }
  bool operator==(const ErrorBounds&) const = default;
};

/// Bounds of `depth_pixels` of a pixel's footprint: a pixel at depth z covers z * pixel_tangent, so that the share of a
/// depth is their product, rounded down. pixel_tangent: (right - left) / width of the frustum at distance 1, or
/// (top - bottom) / height where that is smaller. All are cut to what ErrorBounds may have; less than kLeastDepth, and
/// what is no number, to 0.
ErrorBounds error_bounds(double depth_pixels, double pixel_tangent, int normal, int colour);

/// The largest angle in degrees between a normal and what is decoded of it, over all of them. Precondition: 0 <= codes
/// <= ErrorBounds::kMostNormal. Thread-safe.
double normal_error_degrees(int codes);

}  // namespace telesplat::codec
