// Inside services/data/gltf: one primitive of a mesh. Source: Khronos, "glTF 2.0 Specification", section 3.7.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "services/data/gltf/document.h"

namespace telesplat::data::gltf {

/// Triangles with what their vertices have; `positions` tells how many these are. Others have as many, or none.
struct Primitive {
  Values positions, normals, uv, colours;
  double colour_scale = 1;                         ///< of colours: what makes them 0..1
  std::vector<std::pair<Values, Values>> joints;   ///< numbers of joints and weights: four a vertex each
  std::vector<std::pair<Values, Values>> targets;  ///< of morphs: what moves positions and normals
  std::vector<uint32_t> corners;                   ///< three a triangle, all in range
};

/// Whether a primitive is of points or lines.
bool is_thin(const Json& primitive);

/// Reads triangles, strips and fans, packed by Draco or not. uv_set: TEXCOORD_n that is wanted; nothing: none.
/// deformed: joints and targets are wanted too. Throws Refusal.
Primitive read_primitive(Document& document, const Json& json, std::optional<size_t> uv_set, bool deformed);

}  // namespace telesplat::data::gltf
