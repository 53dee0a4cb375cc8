// Inside services/data/gltf: what colours a primitive. Source: Khronos, "glTF 2.0 Specification", sections 3.8 and 3.9;
// "KHR_texture_transform"; "KHR_materials_pbrSpecularGlossiness"; "EXT_texture_webp".
#pragma once

#include <glm/mat3x2.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <string>
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

}  // namespace telesplat::data::gltf
