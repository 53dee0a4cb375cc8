// Unit normals in 16 or 32 bits: octahedral mapping.
// Source: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace telesplat::image {

namespace detail {

// Octahedral coordinates in [-1, 1]^2 of a vector that is not zero.
inline void to_octahedron(const glm::vec3& n, float& x, float& y) {
  const float scale = 1.0f / (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
  x = n.x * scale, y = n.y * scale;
  if (n.z < 0) {
    const float fx = (1 - std::abs(y)) * (x >= 0 ? 1.0f : -1.0f), fy = (1 - std::abs(x)) * (y >= 0 ? 1.0f : -1.0f);
    x = fx, y = fy;
  }
}

inline glm::vec3 from_octahedron(float x, float y) {
  const float z = 1 - std::abs(x) - std::abs(y);
  const float fold = std::max(-z, 0.0f);
  return glm::normalize(glm::vec3(x + (x >= 0 ? -fold : fold), y + (y >= 0 ? -fold : fold), z));
}

inline uint32_t quantise(float v, uint32_t levels) {  // [-1, 1] -> 0..levels
  return static_cast<uint32_t>(
      std::clamp((v * 0.5f + 0.5f) * static_cast<float>(levels) + 0.5f, 0.0f, static_cast<float>(levels)));
}

}  // namespace detail

/// The code of a direction that encoders write. On the map's border two codes mean the same direction, and the four
/// corners all mean one: the canonical code has the larger coordinates. Coordinates of 255 mean 254.
inline uint16_t canonical_normal16(uint16_t code) {
  const int x = std::min(code & 255, 254), y = std::min(code >> 8, 254);
  const bool side = x == 0 || x == 254, end = y == 0 || y == 254;
  return static_cast<uint16_t>((end ? std::max(x, 254 - x) : x) | (side ? std::max(y, 254 - y) : y) << 8);
}

/// Two 8-bit coordinates, x in the low byte. Largest error about 1 degree. n need not be normalised; (0,0,0) becomes
/// +z. The code is canonical.
inline uint16_t encode_normal16(const glm::vec3& n) {
  float x = 0, y = 0;
  if (glm::dot(n, n) > 0) detail::to_octahedron(n, x, y);
  return canonical_normal16(static_cast<uint16_t>(detail::quantise(x, 254) | detail::quantise(y, 254) << 8));
}
inline glm::vec3 decode_normal16(uint16_t code) {
  const auto at = [](uint32_t c) { return static_cast<float>(c) / 127.0f - 1.0f; };
  return detail::from_octahedron(std::min(at(code & 255), 1.0f), std::min(at(code >> 8), 1.0f));
}

/// A vector along decode_normal16(code), not normalised and free of rounding: its components are integers in [-127,
/// 127]. For tests that need only a direction's side.
inline glm::vec3 octahedral16(uint16_t code) {
  const int x = std::min(code & 255, 254) - 127, y = std::min(code >> 8, 254) - 127;
  const int z = 127 - std::abs(x) - std::abs(y), fold = std::max(-z, 0);
  return {static_cast<float>(x + (x >= 0 ? -fold : fold)), static_cast<float>(y + (y >= 0 ? -fold : fold)),
          static_cast<float>(z)};
}

/// Two 16-bit coordinates, x in the low half.
inline uint32_t encode_normal32(const glm::vec3& n) {
  float x = 0, y = 0;
  if (glm::dot(n, n) > 0) detail::to_octahedron(n, x, y);
  return detail::quantise(x, 65534) | detail::quantise(y, 65534) << 16;
}
inline glm::vec3 decode_normal32(uint32_t code) {
  const auto at = [](uint32_t c) { return std::min(static_cast<float>(c) / 32767.0f - 1.0f, 1.0f); };
  return detail::from_octahedron(at(code & 65535), at(code >> 16));
}

}  // namespace telesplat::image
