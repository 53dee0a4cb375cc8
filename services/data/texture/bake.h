// Textures become colours of vertices: triangles are divided until their vertices carry what the texture shows.
#pragma once

#include <memory>

#include "services/data/base/mesh.h"
#include "services/data/texture/texture.h"

namespace telesplat::data {

inline constexpr uint64_t kDefaultTextureDetail = 4'000'000;
/// Texture coordinates beyond this are taken for damage: the vertex keeps its own colour.
inline constexpr float kMaxUv = 1e4f;

/// How textures lie on a mesh. The three corners of a triangle have the same texture: readers double vertices where
/// materials meet.
struct TextureUse {
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<uint32_t> texture;  ///< one a vertex: of `textures`, or kNoTexture
  std::vector<glm::vec2> uv;      ///< one a vertex; as Texture::sample()
};

/// Multiplies the vertices' colours (white, where the mesh has none) with their textures, in linear light. Before that,
/// edges whose triangle shows more than a straight line of colours between its vertices, and that span more than about
/// one and a half texels, are halved; always for all triangles at the edge, so that no cracks appear. The mesh gets no
/// more than `most_triangles` that way; the edges that are longest in space come first, and vertices that stand for
/// many texels get their mean. Returns a note for people if detail was left out because of that.
/// Preconditions: indices are valid; the mesh has no scalars.
std::string bake_textures(Mesh& mesh, TextureUse use, uint64_t most_triangles);

}  // namespace telesplat::data
