// Inside services/data/gltf: what colours a primitive, primitives of a mesh, and where meshes stand. Source: Khronos,
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
  uint32_t texture = kNoTexture;  ///< of Materials::textures()
  size_t uv_set = 0;              ///< its coordinates are TEXCOORD_n
  glm::dmat3x2 uv{1};             ///< from those of the file to those of the picture
  bool cut = false, blend = false;
  double cutoff = 0.5;  ///< where cut: what is less opaque is not there
};

class Materials {
 public:
  /// name: of the file, for notes. document: outlives this.
  explicit Materials(Document& document, std::string name) : document_(document), name_(std::move(name)) {}

  /// Returns a material with its picture; without a number a white one. Throws Refusal: the picture is damaged, too
  /// large, or of no known format.
  const Material& at(std::optional<size_t> number);

  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<std::string> notes;  ///< pictures that are missing

 private:
  uint32_t load(size_t texture);

  Document& document_;
  const std::string name_;
  std::map<size_t, Material> materials_;
  std::map<size_t, uint32_t> loaded_;  // by textures of the file
  uint64_t room_ = kMaxTexels;
};

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
