// Makes the coarse levels of a mesh: inner nodes of a tree over its chunks, each a mesh of fewer and larger triangles.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/chunk_code.h"

namespace telesplat::data {

/// Chunks that a node of the next level replaces, at most.
inline constexpr size_t kChildren = 4;

/// A level of the tree that is complete.
struct LevelBelow {
  std::span<const geometry::Box> boxes_room;               ///< one a chunk
  std::span<const float> spacings_m;                       ///< one a chunk: CoarseNode::spacing_m; 0: a leaf
  std::function<geometry::HeldChunk(size_t chunk)> chunk;  ///< called on several threads
};

struct CoarseNode {
  std::vector<std::byte> chunk;  ///< layout: geometry/mesh_chunk.h
  float spacing_m = 0;           ///< side of the cells that its vertices are means of
};

/// Makes the node over the chunks [first, last) of the level below, with about `most` triangles, or a fourth of theirs
/// where that is less: vertices in a cell of a grid become one, at the mean place of the surface there, with one normal
/// and colour (or scalar) for each of up to three directions that the surface faces (Rossignac and Borrel 1993;
/// Lindstrom 2000). What is thinner than a cell and would vanish is a small triangle of half its area. The node goes
/// one cell beyond its border, so that no gap opens where it meets a neighbour of another level.
/// The same chunks give the same bytes. No bytes: it would have no triangles, or as many as the chunks.
/// Precondition: first < last.
CoarseNode make_coarse_node(const LevelBelow& below, size_t first, size_t last, size_t most);

}  // namespace telesplat::data
