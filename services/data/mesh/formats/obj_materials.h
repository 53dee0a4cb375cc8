// The materials of a Wavefront OBJ: colours and textures from the libraries (.mtl) beside it. Source: "MTL Material
// Format", Wavefront, Version 4.2, 1995.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::data {

struct ObjMaterial {
  std::optional<uint32_t> colour;  ///< Kd, 0x00RRGGBB
  std::string texture;             ///< path of map_Kd; empty: none
  bool clamp = false;              ///< of the texture: outside of 0..1 it shows its rim
  glm::vec2 scale{1, 1}, offset{0, 0};
};

/// Paths of the libraries that the lines "mtllib" name, beside the OBJ at `path`.
std::vector<std::string> obj_material_libraries(std::string_view content, const std::string& path);

/// By name; of equal names the last. A library that cannot be read has none. Ordered, so that companions are hashed in
/// one order.
std::map<std::string, ObjMaterial> read_obj_materials(const std::vector<std::string>& libraries);

/// The rest of a line as a name: without blanks around it.
std::string rest_of_line(std::string_view content, size_t offset);

}  // namespace telesplat::data
