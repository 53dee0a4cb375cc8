// Inside services/data/gltf: where the meshes of a scene stand. Source: Khronos, "glTF 2.0 Specification", sections 3.5
// and 3.7.3; "EXT_mesh_gpu_instancing".
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <map>
#include <memory>
#include <vector>

#include "services/data/gltf/document.h"

namespace telesplat::data::gltf {

/// One appearance of a mesh.
struct Placement {
  glm::dmat4 to_world{1};
  std::shared_ptr<const std::vector<glm::dmat4>> joints;  ///< of a skin: they take the place of to_world; or null
  std::vector<double> weights;                            ///< of morph targets; empty: those of the mesh
};

/// Where each mesh stands in the file's default scene, else its first, else under all its roots; without nodes each
/// mesh once. Skins stand as their joints do. Throws Refusal: a node is not there, has two parents or lies below
/// itself.
std::map<size_t, std::vector<Placement>> place_meshes(Document& document);

/// The weights that a node or mesh gives to morph targets.
std::vector<double> morph_weights(const Json& of);

}  // namespace telesplat::data::gltf
