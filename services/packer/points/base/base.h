// The base: the levels of a whole mesh. Viewers show some of them where they have no samples. It hides triangles that
// rays have passed: where there is no surface, and where it ends. Samples show such places. No sockets, no clocks.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <map>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "common/image/pixel_mask.h"
#include "common/scene/colouring.h"
#include "common/wire/point_messages.h"
#include "services/packer/points/event.h"

namespace telesplat::packer {

class Base {
 public:
  /// nodes: a list of chunks in the order of their ids. largest_m: side of the mesh's box, metres. colours: of scalars;
  /// null: chunks hold colours.
  Base(std::vector<geometry::ChunkInfo> nodes, float largest_m, const scene::ColourTable* colours);

  const std::vector<geometry::ChunkInfo>& nodes() const { return nodes_; }
  /// Parts of all nodes.
  uint64_t parts() const { return first_part_.back(); }
  /// Precondition: part < parts().
  uint32_t node_of(uint64_t part) const;
  /// True if a node's triangles are held.
  bool has(uint32_t node) const { return held_.contains(node); }
  /// Takes the triangles of a node. False: they are not what the list says.
  bool add(uint32_t node, const geometry::MeshChunkView& chunk);
  /// Drops nodes that no viewer asked for, and no tile showed, for longest, as long as more triangles are held. Their
  /// triangles are not hidden any more.
  void keep_within(uint64_t triangles);
  /// The caller fills in packer and base. Its bytes lie in this object. Precondition: its node is held.
  wire::BasePart part(uint64_t part);
  /// Triangles that are held.
  uint64_t triangles() const { return triangles_; }

  /// Hides the triangles that rays of a tile passed, where its pixels are as fine as the triangles. Leaves' stay.
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
  static constexpr size_t kWords = wire::kBasePart / 64;
  using Bits = std::array<uint64_t, kWords>;  // a bit for each triangle of a part
  struct Part {
    geometry::Box box;
    float side_m;                    // mean side of its triangles
    std::vector<glm::vec3> corners;  // three a triangle; empty: they are the mesh itself
    std::vector<std::byte> code;
  };
  struct Held {
    std::vector<Part> parts;
    uint64_t used = 0;  // uses_ when it was asked for
  };
  struct Look;
  Part make_part(const geometry::MeshChunkView& chunk, std::span<const uint32_t> corners, bool leaf) const;
  void hide(uint64_t number, const Part& part, float error_m, const Look& look);
  void set_word(uint64_t part, Bits& bits, size_t word, uint64_t to);

  const std::vector<geometry::ChunkInfo> nodes_;
  const std::vector<uint64_t> first_part_;
  const float step_m_;  // positions are multiples of it: they take fewer bytes
  const scene::ColourTable* const colours_;
  std::map<uint32_t, Held> held_;
  uint64_t triangles_ = 0, uses_ = 0;
  std::unordered_map<uint64_t, Bits> hidden_;  // by part, where any triangle is hidden
  std::unordered_set<uint64_t> changed_;       // words since take_changes()
};

}  // namespace telesplat::packer
