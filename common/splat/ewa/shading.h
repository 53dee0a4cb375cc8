// Shading of interpolated normals: image::Shading's formula on camera axes, for normals of any length.
#pragma once

#include "common/image/shading.h"
#include "common/splat/pixel_key.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::splat {

/// I(n) = ambient + head |n . backward| + key max(0, n . key_direction), cut to 0..1; the head light lies along the
/// view axis.
struct EwaLight {
  float ambient = 1, head = 0, key = 0;
  std::array<float, 3> key_direction{};  ///< in camera axes
  uint32_t background = 0;               ///< 0x00RRGGBB, of empty pixels
};

inline EwaLight ewa_light(const image::ShadingParameters& p, const SurfelCamera& c) {
  if (!p.lit) return {};
  const float x = p.key_direction_room.x, y = p.key_direction_room.y, z = p.key_direction_room.z;
  return {p.ambient, p.head, p.key, {dot(c.right, x, y, z), dot(c.down, x, y, z), dot(c.forward, x, y, z)}};
}

/// Sums that the second pass gathers in a pixel: weight times each value.
struct EwaSum {
  float red = 0, green = 0, blue = 0, weight = 0;
  float normal_x = 0, normal_y = 0, normal_z = 0, depth_code = 0;
};

/// 0x00RRGGBB. Precondition: sum.weight > 0.
inline uint32_t ewa_colour(const EwaSum& s, const EwaLight& light) {
  const auto [kx, ky, kz] = light.key_direction;
  const float length2 = (s.normal_x * s.normal_x + s.normal_y * s.normal_y) + s.normal_z * s.normal_z;
  // Normals that cancel are lit as if they lay across the view.
  const float scale = 1.0f / std::sqrt(std::max(length2, 1e-30f));
  const float head = std::abs(s.normal_z) * scale;
  const float key = std::max(((s.normal_x * kx + s.normal_y * ky) + s.normal_z * kz) * scale, 0.0f);
  const float intensity = std::clamp((light.ambient + light.head * head) + light.key * key, 0.0f, 1.0f);
  const float per_weight = intensity / s.weight;
  const auto channel = [&](float sum) {
    return static_cast<uint32_t>(static_cast<int32_t>(std::min(sum * per_weight + 0.5f, 255.0f)));
  };
  return channel(s.red) << 16 | channel(s.green) << 8 | channel(s.blue);
}

/// The mean depth code, rounded.
inline uint32_t ewa_depth_code(const EwaSum& s) {
  const float code = std::min(s.depth_code / s.weight + 0.5f, static_cast<float>(kMaxDepthCode));
  return static_cast<uint32_t>(static_cast<int32_t>(std::max(code, 0.0f)));
}

}  // namespace telesplat::splat
