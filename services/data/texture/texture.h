// Pictures that cover a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/image/file.h"

namespace telesplat::data {

/// What a texture shows outside of 0..1.
enum class Wrap : uint8_t { kRepeat, kClamp, kMirror };

inline constexpr size_t kMaxTexels = size_t{1} << 28;  ///< of all textures of a mesh

/// Immutable, safe to read from any thread.
class Texture {
 public:
  /// picture: sRGB codes. nearest: not interpolated between texels, for pictures of few, sharp texels.
  Texture(image::View picture, Wrap wrap_u, Wrap wrap_v, bool nearest = false);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  bool nearest() const { return nearest_; }
  /// All texels have one colour.
  bool plain() const { return plain_; }

  /// Linear light, 0 to 1. (0, 0) is the upper left corner of the picture, v goes down. level: of halvings of the
  /// picture, for colours that stand for many texels.
  glm::vec3 sample(glm::vec2 uv, int level = 0) const;
  /// Length in texels.
  float texels(glm::vec2 from, glm::vec2 to) const;

 private:
  struct Level {
    int width, height;
    std::vector<uint32_t> texels;  // 0xRRGGBB
  };
  glm::vec3 texel(const Level& level, int64_t x, int64_t y) const;

  std::vector<Level> levels_;
  std::array<Wrap, 2> wrap_;
  bool nearest_, plain_;
};

}  // namespace telesplat::data
