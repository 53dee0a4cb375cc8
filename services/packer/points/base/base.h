// The base: the coarse form of a whole mesh, which viewers show where they have no samples. It hides triangles that
// rays have passed: where there is no surface, and where it ends. Samples show such places. No sockets, no clocks.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/mesh_chunk.h"
#include "common/image/pixel_mask.h"
#include "common/scene/colouring.h"
#include "common/wire/point_messages.h"
#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Chunks that a base is made of. No two of `fine` lie on one way from the root.
struct BaseChunks {
  std::vector<ChunkId> coarse;  ///< the roots of the tree; empty: they are the fine ones
  std::vector<ChunkId> fine;
};

/// Chooses chunks of at most `most` triangles together that have the whole mesh, or the roots where these have more:
/// the coarsest is parted while there is room. tree: a list of chunks in the order of their ids (geometry::ChunkInfo).
BaseChunks choose_base(const std::vector<geometry::ChunkInfo>& tree, uint64_t most);

class Base {
 public:
  /// largest_m: side of the mesh's box, metres. colours: of scalars; null: chunks hold colours.
  Base(float largest_m, const scene::ColourTable* colours);

  /// Adds the triangles of a chunk. spacing_m: geometry::ChunkInfo::spacing_m. coarse: of BaseChunks::coarse.
  /// Precondition: all coarse ones come first.
  void add(const geometry::MeshChunkView& chunk, float spacing_m, bool coarse);

  /// Triangles of the fine parts.
  size_t triangles() const { return triangles_; }
  size_t parts() const { return parts_.size(); }
  size_t coarse_parts() const { return coarse_; }
  /// The caller fills in packer and base. Its bytes lie in this object. Precondition: n < parts().
  wire::BasePart part(size_t n) const { return {{}, 0, n, double{parts_[n].error_m}, parts_[n].code}; }

  /// Hides the fine triangles that rays of a tile passed, where its pixels are as fine as the triangles.
  /// cast: its rays, as large as the tile; null: all pixels.
  void hide(const SampledTile& tile, const image::PixelMask* cast);
  /// Shows the triangles with their centroid in a box again: the samples there were forgotten.
  void show(const geometry::Box& box);
  void show_all();

  /// Words that changed since the last call, as in wire::BaseHidden.
  std::vector<uint32_t> take_changes();
  /// All words that are not 0.
  std::vector<uint32_t> hidden() const;

 private:
  struct Part {
    geometry::Box box;
    float error_m;                   // how far the surface may lie away
    float side_m;                    // mean side of its triangles
    std::vector<glm::vec3> corners;  // three a triangle; empty: they are the mesh itself
    std::vector<std::byte> code;
  };
  struct Look;
  void add_part(const geometry::MeshChunkView& chunk, size_t first, size_t count, float spacing_m);
  bool is_hidden(size_t i) const { return hidden_[i / 64] >> i % 64 & 1; }
  void set_hidden(size_t i, bool hidden);

  const float step_m_;  // positions are multiples of it: they take fewer bytes
  const scene::ColourTable* const colours_;
  std::vector<Part> parts_;
  size_t coarse_ = 0, triangles_ = 0;
  std::vector<uint64_t> hidden_, told_;  // a bit a triangle, by its number; told_: as take_changes() last had them
};

}  // namespace telesplat::packer
