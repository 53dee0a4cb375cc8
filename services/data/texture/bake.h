// Turns textures into colours of vertices: triangles are divided until their vertices carry the texture's detail.
#pragma once

#include <memory>

#include "services/data/base/mesh.h"
#include "services/data/texture/texture.h"

namespace telesplat::data {

inline constexpr uint64_t kDefaultTextureDetail = 4'000'000;
/// Texture coordinates beyond this count as damaged: the vertex keeps its own colour.
inline constexpr float kMaxUv = 1e4f;

/// Textures of a mesh and their coordinates. The three corners of a triangle have the same texture: readers double
/// vertices where materials meet.
struct TextureUse {
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<uint32_t> texture;  ///< one per vertex: index into `textures`, or kNoTexture
  std::vector<glm::vec2> uv;      ///< one per vertex; as in Texture::sample()
};

/// Multiplies the vertices' colours (white, where the mesh has none) with their textures, in linear light. First halves
/// edges that span more than about one and a half texels if their triangle shows more than a straight line of colours
/// between its vertices; always for all triangles at the edge, so that no cracks appear. The mesh gets at most
/// `most_triangles` that way; the edges that are longest in space come first, and vertices that cover many texels get
/// their mean. Returns a note for users if this limit cost detail, else an empty text.
/// Preconditions: indices are valid; the mesh has no scalars.
std::string bake_textures(Mesh& mesh, TextureUse use, uint64_t most_triangles);

}  // namespace telesplat::data
