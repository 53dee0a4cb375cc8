// Bounds of the difference between a decoded depth image and the encoded one.
#pragma once

#include <cstdint>

namespace telesplat::codec {

/// Bounds that hold in every covered pixel. The set of covered pixels is always exact.
struct ErrorBounds {
  /// In 2^-32: |code - decoded code| <= depth / 2^32 * decoded code. A depth in metres is the reciprocal of its code,
  /// so its relative error has the same bound. 0 is exact; less than kLeastDepth counts as 0.
  uint32_t depth = 0;
  int normal = 0;  ///< codes of each coordinate on the octahedron's map, turned by the tile's pole; 0..kMostNormal
  int colour = 0;  ///< steps of 255 of each channel; 0..kMostColour

  static constexpr uint32_t kLeastDepth = 1u << 14;  ///< a 262144th: below it nearly all codes would be exact
  static constexpr uint32_t kMostDepth = 1u << 28;   ///< a sixteenth
  static constexpr int kMostNormal = 3, kMostColour = 15;

  bool exact() const { return depth < kLeastDepth && normal == 0 && colour == 0; }
  bool operator==(const ErrorBounds&) const = default;
};

/// Bounds of `depth_pixels` of a pixel's footprint: a pixel at depth z covers z * pixel_tangent, so the bound of a
/// depth is their product, rounded down. pixel_tangent: the smaller of (right - left) / width of the frustum at
/// distance 1 and (top - bottom) / height. Values are cut to the limits of ErrorBounds; less than kLeastDepth, and NaN,
/// becomes 0.
ErrorBounds error_bounds(double depth_pixels, double pixel_tangent, int normal, int colour);

/// The largest angle in degrees between a normal and its decoded one, over all normals. Precondition: 0 <= codes <=
/// ErrorBounds::kMostNormal. Thread-safe.
double normal_error_degrees(int codes);

}  // namespace telesplat::codec
