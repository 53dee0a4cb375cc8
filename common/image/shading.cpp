#include "common/image/shading.h"

#include <glm/geometric.hpp>
#include <vector>

#include "common/image/normal.h"

namespace telesplat::image {
namespace {

// All 65536 decoded normals: the same for every view.
const std::vector<glm::vec3>& all_normals() {
  static const std::vector<glm::vec3> normals = [] {
    std::vector<glm::vec3> out(65536);
    for (uint32_t code = 0; code < 65536; ++code) out[code] = decode_normal16(static_cast<uint16_t>(code));
    return out;
  }();
  return normals;
}

}  // namespace

std::optional<ShadingParameters> shading_named(std::string_view name) {
  ShadingParameters p;
  if (name == "lit") return p;
  if (name == "head") {
    p.head += p.key;  // keeps the brightness of surfaces that face the viewer
    p.key = 0;
    return p;
  }
  if (name == "unlit") {
    p.lit = false;
    return p;
  }
  return std::nullopt;
}

Shading::Shading(const ShadingParameters& parameters, const geometry::Camera& camera)
    : parameters_(parameters),
      head_room_(camera.pose.orientation * glm::dvec3(0, 0, 1)),
      table_(std::make_shared<std::array<uint8_t, 65536>>()) {
  const auto& normals = all_normals();
  for (size_t i = 0; i < 65536; ++i) (*table_)[i] = static_cast<uint8_t>(intensity(normals[i]) * 255.0f + 0.5f);
}

float Shading::intensity(const glm::vec3& n) const {
  if (!parameters_.lit) return 1.0f;
  const float i = parameters_.ambient + parameters_.head * std::abs(glm::dot(n, head_room_)) +
                  parameters_.key * std::max(0.0f, glm::dot(n, parameters_.key_direction_room));
  return std::clamp(i, 0.0f, 1.0f);
}

uint32_t Shading::apply(uint32_t albedo, uint32_t i) {
  const auto channel = [&](int shift) { return (((albedo >> shift & 255) * i + 127) / 255) << shift; };
  return channel(16) | channel(8) | channel(0);
}

}  // namespace telesplat::image
