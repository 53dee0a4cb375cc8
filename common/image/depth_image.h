// Depth images: the G-buffer of one sampling view or of one tile in it (T4.2.1).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace telesplat::image {

inline constexpr uint32_t kMaxDepthCode = (1u << 24) - 1;

/// Bytes of one pixel before compression: 24-bit depth, 24-bit colour, 16-bit normal.
inline constexpr int kRawBytesPerPixel = 8;

/// Planes of width x height pixels, row-major from the upper left, no padding.
/// Canonical form, which every producer keeps and the codec relies on: depth 0 means an empty pixel, whose colour and
/// normal are 0, too. "Coverage" is depth != 0.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<uint32_t> depth;   ///< 24-bit reciprocal depth code, 1..kMaxDepthCode, larger is nearer; 0: empty
  std::vector<uint32_t> colour;  ///< 0x00RRGGBB, unlit albedo
  std::vector<uint16_t> normal;  ///< octahedral, see image/normal.h: encode_normal16; room space, facing the camera

  DepthImage() = default;
  DepthImage(int w, int h) : width(w), height(h), depth(size_t(w) * h), colour(size_t(w) * h), normal(size_t(w) * h) {}
  size_t pixels() const { return depth.size(); }
  bool operator==(const DepthImage&) const = default;
};

/// Code of a depth: round((near / depth) * (2^24 - 1)), clamped to 1..2^24-1. Reciprocal depth is linear in screen
/// space, so planes are predicted exactly. Precondition: depth_m > 0.
inline uint32_t encode_depth(double depth_m, double near_m) {
  const double code = std::floor(near_m / depth_m * kMaxDepthCode + 0.5);
  return static_cast<uint32_t>(std::clamp(code, 1.0, static_cast<double>(kMaxDepthCode)));
}

/// Depth in metres of a code. Precondition: code != 0.
inline double decode_depth(uint32_t code, double near_m) { return near_m * kMaxDepthCode / code; }

}  // namespace telesplat::image
