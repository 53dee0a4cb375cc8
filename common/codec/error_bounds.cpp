#include "common/codec/error_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/codec/lattice.h"
#include "common/core/check.h"
#include "common/image/normal.h"

namespace telesplat::codec {
namespace {

constexpr double kDepthOne = 4294967296.0;  // 2^32

double angle_deg(uint16_t a, uint16_t b) {
  const glm::dvec3 u(image::octahedral16(a)), v(image::octahedral16(b));
  // Not by the cosine, which is imprecise for small angles.
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)) * 180 / std::numbers::pi;
}

// Turning the octahedron changes no angle, so that one pole represents all.
double largest_angle_deg(int codes) {
  const detail::NormalLattice lattice(codes);
  double most = 0;
  for (int y = 0; y < 255; ++y)
    for (int x = 0; x < 255; ++x)
      most = std::max(most, angle_deg(static_cast<uint16_t>(x | y << 8),
                                      static_cast<uint16_t>(lattice.nearest(x) | lattice.nearest(y) << 8)));
  return most;
}

}  // namespace

ErrorBounds error_bounds(double depth_pixels, double pixel_tangent, int normal, int colour) {
  ErrorBounds out;
  const double share = depth_pixels * pixel_tangent * kDepthOne;
  if (share >= ErrorBounds::kLeastDepth)  // false if it is NaN
    out.depth = static_cast<uint32_t>(std::min<double>(share, ErrorBounds::kMostDepth));
  out.normal = std::clamp(normal, 0, ErrorBounds::kMostNormal);
  out.colour = std::clamp(colour, 0, ErrorBounds::kMostColour);
  return out;
}

double normal_error_degrees(int codes) {
  CHECK(codes >= 0 && codes <= ErrorBounds::kMostNormal);
  static const auto all = [] {
    std::array<double, ErrorBounds::kMostNormal + 1> angles{};
    for (int n = 1; n <= ErrorBounds::kMostNormal; ++n) angles[static_cast<size_t>(n)] = largest_angle_deg(n);
    return angles;
  }();
  return all[static_cast<size_t>(codes)];
}

}  // namespace telesplat::codec
