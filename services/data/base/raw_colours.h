// Colours as a file holds them: their range is known only when all are read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Collects colours, then packs them: channels go up to 1 if none in the file is above it, else to 255, else to 65535.
class RawColours {
 public:
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  bool empty() const { return raw_.empty(); }
  size_t size() const { return raw_.size(); }
  void add(glm::vec3 colour) {
    largest_ = std::max({largest_, colour.x, colour.y, colour.z});
    raw_.push_back(colour);
  }
  /// Adds items without a colour until there are `size`.
  void fill(size_t size) { raw_.resize(size, glm::vec3(kNone)); }

  /// Returns 0x00RRGGBB for each; `none` for items without a colour. least: channels count at least up to this.
  std::vector<uint32_t> packed(uint32_t none, float least = 1) const {
    constexpr float kRounding = 1.01f;  // programs that compute with floats exceed 1 by a little
    float full = largest_ <= kRounding ? 1.0f : largest_ <= 255 * kRounding ? 255.0f : 65535.0f;
    full = std::max(full, least);
    const auto channel = [&](float v) { return v > 0 ? uint32_t(std::min(v * (255 / full) + 0.5f, 255.0f)) : 0; };
    std::vector<uint32_t> out;
    out.reserve(raw_.size());
    for (const glm::vec3& c : raw_)
      out.push_back(c.x == c.x ? pack_rgb(channel(c.x), channel(c.y), channel(c.z)) : none);
    return out;
  }

 private:
  std::vector<glm::vec3> raw_;
  float largest_ = 0;
};

}  // namespace telesplat::data
