// Inside services/data/gltf: colours of a primitive, primitives of a mesh, and positions of meshes. Source: Khronos,
// "glTF 2.0 Specification", sections 3.5 to 3.9; "KHR_texture_transform"; "KHR_materials_pbrSpecularGlossiness";
// "EXT_texture_webp"; "EXT_mesh_gpu_instancing".
#pragma once

#include <cstdint>
#include <glm/mat3x2.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/data/gltf/document.h"
#include "services/data/texture/bake.h"

namespace telesplat::data::gltf {

struct Material {
  glm::dvec4 factor{1};           ///< linear light, and opacity
  uint32_t texture = kNoTexture;  ///< index into Materials::textures
  size_t uv_set = 0;              ///< its coordinates are TEXCOORD_n
  glm::dmat3x2 uv{1};             ///< from the file's coordinates to the picture's
  bool cut = false, blend = false;
  double cutoff = 0.5;  ///< with `cut`: parts that are less opaque are left out
};

class Materials {
 public:
  /// name: the file's, for notes. document: outlives this.
  explicit Materials(Document& document, std::string name) : document_(document), name_(std::move(name)) {}

  /// Returns a material with its picture; without a number, a white one. Throws Refusal: the picture is damaged, too
  /// large, or of no known format.
  const Material& at(std::optional<size_t> number);

  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<std::string> notes;  ///< pictures that are missing

 private:
  uint32_t load(size_t texture);

  Document& document_;
  const std::string name_;
  std::map<size_t, Material> materials_;
  std::map<size_t, uint32_t> loaded_;  // by number of the file's texture
  uint64_t room_ = kMaxTexels;
};

/// Triangles and their vertices' values; `positions` gives the number of vertices. Other values have as many, or none.
struct Primitive {
  Values positions, normals, uv, colours;
  double colour_scale = 1;                         ///< factor that scales `colours` to 0..1
  std::vector<std::pair<Values, Values>> joints;   ///< numbers of joints, and weights: four of each per vertex
  std::vector<std::pair<Values, Values>> targets;  ///< morphs: displacements of positions and normals
  std::vector<uint32_t> corners;                   ///< three per triangle, all in range
};

/// True if a primitive consists of points or lines.
bool is_thin(const Json& primitive);

/// Reads triangles, strips and fans, packed by Draco or not. uv_set: the wanted TEXCOORD_n; nullopt: no texture
/// coordinates. deformed: joints and targets are wanted, too. Throws Refusal.
Primitive read_primitive(Document& document, const Json& json, std::optional<size_t> uv_set, bool deformed);

/// One appearance of a mesh.
struct Placement {
  glm::dmat4 to_world{1};
  std::shared_ptr<const std::vector<glm::dmat4>> joints;  ///< a skin's: they replace to_world; or null
  std::vector<double> weights;                            ///< weights of morph targets; empty: the mesh's own
};

/// Returns the positions of each mesh in the file's default scene, else its first, else under all its roots; without
/// nodes each mesh once. Skins stand as their joints do. Throws Refusal: a node does not exist, has two parents or lies
/// below itself.
std::map<size_t, std::vector<Placement>> place_meshes(Document& document);

/// Returns the weights that a node or mesh gives to morph targets.
std::vector<double> morph_weights(const Json& of);

}  // namespace telesplat::data::gltf
