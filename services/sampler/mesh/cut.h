// Chooses the chunks of a mesh's tree that a view is sampled from: no finer than its pixels, as far as they are held.
#pragma once

#include <functional>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/mesh_chunk.h"

namespace telesplat::sampler {

/// Pixels that the vertices of a chunk may lie apart, where it is nearest, to stand for the chunks below it.
inline constexpr double kMostSpacing = 0.7;

struct Cut {
  std::vector<ChunkId> shown;  ///< to be sampled, in order of id; no two of them lie on one way from the root
  std::vector<ChunkId>
      missing;        ///< not held: those that belong here and those above them, coarsest first, then nearest
  bool fine = true;   ///< `shown` is all that belongs here; false: some of it is coarser, or missing
  bool whole = true;  ///< `shown` has something for every part of the view
};

/// tree: a list of chunks in the order of their ids (geometry::ChunkInfo). camera: of the view, whose pixels decide.
/// part: the part of the mesh that counts. held(id) says if a chunk is there.
Cut choose_cut(const std::vector<geometry::ChunkInfo>& tree, const geometry::Camera& camera,
               const geometry::Frustum& part, const std::function<bool(ChunkId)>& held);

}  // namespace telesplat::sampler
