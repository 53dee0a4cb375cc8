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

#include "services/data/base/mapped_file.h"

namespace telesplat::data {

struct ObjMaterial {
  std::optional<uint32_t> colour;  ///< Kd, 0x00RRGGBB
  std::string texture;             ///< map_Kd, relative to the OBJ's folder; empty: no texture
  std::string not_applied;         ///< an unsupported option of map_Kd that changes its colours
  bool clamp = false;              ///< outside of 0..1 the texture shows its border
  glm::vec2 scale{1, 1}, offset{0, 0};
};

/// Returns the libraries of the lines "mtllib". The rest of a line is one name, if that file exists, else several.
std::vector<std::string> obj_material_libraries(std::string_view content, Companions& companions);

/// Returns the materials by name; of equal names the last. A library that cannot be read is added to `missing`.
/// Ordered, so that companions are hashed in one order.
std::map<std::string, ObjMaterial> read_obj_materials(const std::vector<std::string>& libraries, Companions& companions,
                                                      std::vector<std::string>& missing);

}  // namespace telesplat::data
