// Pictures that cover a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/image/file.h"
#include "services/data/base/mapped_file.h"

namespace telesplat::data {

/// Continuation of a texture outside of 0..1.
enum class Wrap : uint8_t { kRepeat, kClamp, kMirror };

inline constexpr uint32_t kNoTexture = ~uint32_t{0};
inline constexpr size_t kMaxTexels = size_t{1} << 28;  ///< in all textures of a mesh

glm::vec3 linear_of(uint32_t rgb);  ///< converts sRGB codes to linear light

/// Immutable, safe to read from any thread.
class Texture {
 public:
  /// picture: sRGB codes. nearest: not interpolated between texels, for pictures with few, sharp texels.
  Texture(image::View picture, Wrap wrap_u, Wrap wrap_v, bool nearest = false);

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  bool nearest() const { return nearest_; }
  /// True if all texels have one colour.
  bool plain() const { return plain_; }

  /// Returns linear light, 0 to 1. (0, 0) is the upper left corner of the picture, v goes down. level: number of
  /// halvings of the picture, for colours that stand for many texels.
  glm::vec3 sample(glm::vec2 uv, int level = 0) const;
  /// Returns the distance in texels.
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

class NamedTextures {
 public:
  /// file: for notes and error texts.
  NamedTextures(const std::string& file, Companions& companions) : file_(file), companions_(companions) {}

  /// Returns the number of a picture with this wrapping among all(). A picture is read once for each way to wrap it.
  /// kNoTexture: it cannot be opened; notes() names it once. Throws Refusal: it is damaged, or exceeds kMaxTexels with
  /// others.
  uint32_t number_of(const std::string& picture, Wrap wrap);

  const std::vector<std::shared_ptr<const Texture>>& all() const { return all_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  const std::string& file_;
  Companions& companions_;
  std::map<std::pair<std::string, Wrap>, uint32_t> numbers_;
  std::vector<std::shared_ptr<const Texture>> all_;
  std::vector<std::string> notes_;
  uint64_t room_ = kMaxTexels;
};

}  // namespace telesplat::data
