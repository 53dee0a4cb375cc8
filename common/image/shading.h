// Shading, the same for splatted points, direct rendering and verification: intensity from the normal, times albedo.
//   I(n) = ambient + head * |n . h| + key * max(0, n . k)
// h: the camera's backward axis (a head light at infinity), k: a fixed direction in room space. The head light lights
// both sides.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string_view>

#include "common/geometry/camera.h"

namespace telesplat::image {

struct ShadingParameters {
  float ambient = 0.15f, head = 0.6f, key = 0.25f;
  glm::vec3 key_direction_room{-0.4082f, 0.8165f, 0.4082f};  ///< towards the light, unit length
  uint32_t background = 0x00141820;                          ///< 0x00RRGGBB
  bool lit = true;                                           ///< false: albedo unchanged
};

/// Names of kinds of shading, for --shading: "lit" (both lights and ambient), "head" (the head light alone, so that
/// light follows the viewer), "unlit" (albedo unchanged).
inline constexpr std::array kShadingNames{"lit", "head", "unlit"};
std::optional<ShadingParameters> shading_named(std::string_view name);

/// Shading for one view.
class Shading {
 public:
  Shading(const ShadingParameters& parameters, const geometry::Camera& camera);

  /// Intensity of a unit normal (room space), 0..1.
  float intensity(const glm::vec3& normal_room) const;
  /// Intensity in 1/255 for each of the 65536 normals of image/normal.h: encode_normal16. Built on construction.
  const std::array<uint8_t, 65536>& table() const { return *table_; }
  /// 0x00RRGGBB of albedo lit by intensity i/255: each channel (c * i + 127) / 255.
  static uint32_t apply(uint32_t albedo, uint32_t i);
  uint32_t background() const { return parameters_.background; }
  const ShadingParameters& parameters() const { return parameters_; }

 private:
  ShadingParameters parameters_;
  glm::vec3 head_room_;
  std::shared_ptr<std::array<uint8_t, 65536>> table_;
};

}  // namespace telesplat::image
