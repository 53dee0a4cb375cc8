// Periodic palettes for Julia sets, by the order of julia::palette_names().
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

namespace telesplat::sampler {

class JuliaPalette {
 public:
  static constexpr int kEntries = 1024;

  /// A closed Catmull-Rom curve through `stops` (0x00RRGGBB, at least 3), evenly spaced in [0, 1), clamped to the cube
  /// of colours.
  template <size_t kStops>
  explicit JuliaPalette(const uint32_t (&stops)[kStops]) : JuliaPalette(stops, kStops) {}

  /// 0..255 per channel. tone: any finite number; the whole part means nothing, others are 0.
  const glm::vec3& at(float tone) const;
  /// at(tone) * light, rounded: 0x00RRGGBB. light: 0..1.
  uint32_t rounded(float tone, float light) const {
    const glm::vec3 c = at(tone) * light + 0.5f;
    return static_cast<uint32_t>(c.x) << 16 | static_cast<uint32_t>(c.y) << 8 | static_cast<uint32_t>(c.z);
  }

 private:
  JuliaPalette(const uint32_t* stops, size_t count);
  glm::vec3 entries_[kEntries];
};

/// Precondition: an index into julia::palette_names().
const JuliaPalette& julia_palette(int index);
/// How many palettes there are, which is how many names there must be.
int julia_palette_count();

}  // namespace telesplat::sampler
