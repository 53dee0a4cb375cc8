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
  std::string texture;             ///< map_Kd, named from the OBJ's folder; empty: none
  std::string not_applied;         ///< an option of map_Kd that changes its colours; empty: none
  bool clamp = false;              ///< of the texture: outside of 0..1 it shows its rim
  glm::vec2 scale{1, 1}, offset{0, 0};
};

/// The libraries that the lines "mtllib" name. The rest of a line is one name, if there is such a file, else several.
std::vector<std::string> obj_material_libraries(std::string_view content, Companions& companions);

/// By name; of equal names the last. A library that cannot be read has none, and adds itself to `missing`. Ordered, so
/// that companions are hashed in one order.
std::map<std::string, ObjMaterial> read_obj_materials(const std::vector<std::string>& libraries, Companions& companions,
                                                      std::vector<std::string>& missing);

}  // namespace telesplat::data
