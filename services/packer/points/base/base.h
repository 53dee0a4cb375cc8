// The base: the coarse form of the whole data set, which viewers show where they have nothing finer. It hides surfels
// that rays have passed: where there is no surface, and where it ends, because a surfel would reach beyond it. Samples
// show such places. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/geometry/surfels.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"
#include "common/scene/colouring.h"
#include "common/wire/point_messages.h"
#include "services/packer/points/event.h"

namespace telesplat::packer {

class Base {
 public:
  /// Octree levels of its leaves, at most: 16 x 16 x 16 leaves.
  static constexpr int kDepth = 4;
  /// Surfels of a part, about: 50 kB.
  static constexpr size_t kPart = 12000;

  /// colours: of scalars; null: surfels hold colours. Precondition: a valid set and model.
  Base(const geometry::SurfelView& set, const points::ModelConfig& model, const scene::ColourTable* colours);

  size_t surfels() const { return positions_.size(); }
  size_t parts() const { return parts_.size(); }
  /// Part 0 has one surfel in wire::kBaseStride, the others all of them. The caller fills in packer and base. Its bytes
  /// lie in this object. Precondition: part < parts().
  wire::BasePart part(size_t part) const;

  /// Hides the surfels around which rays of a tile passed their surface, where its pixels are as fine as the surfels.
  /// cast: its rays, as large as the tile; null: all pixels.
  void hide(const SampledTile& tile, const image::PixelMask* cast);
  /// Shows the surfels in a box again: the samples there were forgotten.
  void show(const geometry::Box& box);
  void show_all();

  /// Words that changed since the last call, as in wire::BaseHidden.
  std::vector<uint32_t> take_changes();
  /// All words that are not 0.
  std::vector<uint32_t> hidden() const;

 private:
  struct Leaf {
    points::ClusterKey key;
    geometry::Box box;  // holds its surfels
    uint32_t first, count;
    uint32_t shown;  // surfels that are not hidden
  };
  struct Look;
  bool is_passed(const Look& look, const glm::vec3& position, uint16_t normal, float farthest_m) const;
  bool is_hidden(size_t i) const { return hidden_[i / 64] >> i % 64 & 1; }
  void flip(Leaf& leaf, size_t i);

  points::ModelConfig config_;
  float spacing_m_;
  std::vector<Leaf> leaves_;             // ascending keys
  std::vector<glm::vec3> positions_;     // by leaf, in each leaf by place
  std::vector<uint16_t> normals_;        // image/normal.h: encode_normal16
  std::vector<uint64_t> hidden_, told_;  // a bit a surfel; told_: as take_changes() last had them
  std::vector<std::vector<uint8_t>> parts_;
};

}  // namespace telesplat::packer
