// Notes the space that rays have passed through or found a surface in; the rest is unseen and may hide a surface. Space
// carving (Kutulakos and Seitz 2000, "A Theory of Shape by Space Carving") with depths: a cell is seen once every
// ray of a view that passes it went on behind it.
// No clocks. One thread at a time; carve() and project() use oneTBB inside.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"

namespace telesplat::packer {

/// One bit per cell of 256^3 over the octree's cube: 1 = unseen. A block is 2x2x2 cells; only a block whose cells are
/// all unseen counts as hiding a surface, so that slivers beside edges cost no rays. Space outside the data set's box
/// counts as seen from the beginning: it is empty.
class KnownEmpty {
 public:
  static constexpr int kCellLevel = 8, kBlockLevel = kCellLevel - 1;
  /// Blocks around points and cells at an image's border count as seen up to this length in pixels; otherwise rays that
  /// graze a surface would be cast again and again. Longer ones, as near a head within the data, stay unseen: they may
  /// hold surfaces that no ray has met.
  static constexpr float kFewPixels = 8;

  /// Precondition: points::validate(model).
  explicit KnownEmpty(const points::ModelConfig& model);

  /// A new epoch: everything inside the data set's box becomes unseen.
  void clear();

  /// Points came: marks as seen the blocks that hold them, and blocks around as far as the points lie apart; one block
  /// more where a block is at most kFewPixels points long.
  void add(const points::PreparedPatch& patch);
  /// The same for all points of a model.
  void add(const points::PointModel& model);

  /// Clusters were forgotten: their leaves become unseen.
  void forget(std::span<const points::ClusterKey> clusters);

  /// Rays hit a surface in space known as empty: three blocks around each point become unseen, so that the next views
  /// look at all of them. (Points that are added later make their surroundings seen again: add() first.)
  void refill(std::span<const glm::vec3> points_room);

  /// Marks the space that a view has seen. clear_m: for each pixel of `camera` the depth up to which its ray is known
  /// to have met nothing: 0 where it was not cast, +infinity where it missed or passes only seen space, else the
  /// depth of the surface that it hit, or that the model shows there (with nothing unseen before it). Negative: clear
  /// up to -clear_m, but known before: nodes passed by such rays alone are skipped, so that the cost follows the new
  /// rays. Call it after add() of the points that the rays found. Precondition: validate(camera), clear_m of its size.
  void carve(const geometry::Camera& camera, std::span<const float> clear_m, int threads);

  /// Sets the pixels of `camera` whose rays pass unseen blocks before shown_m, the depth that the model shows there
  /// (+infinity: nothing; negative: pixel not asked for). So an unset pixel that shows nothing is known empty, and a
  /// set pixel that shows a surface may have another before it. Conservative by at most two pixels. may_hold becomes a
  /// mask of the camera's size. Precondition: validate(camera), shown_m of its size.
  void project(const geometry::Camera& camera, std::span<const float> shown_m, int threads,
               image::PixelMask& may_hold) const;

  /// True if no ray has looked into the cell around this place, as inside a solid. Outside the data set's box all is
  /// seen.
  bool unseen_at(const glm::dvec3& room) const;

  /// For tests and records.
  bool unseen(const glm::ivec3& cell) const;
  uint64_t unseen_cells() const;
  double cell_m() const { return std::ldexp(grid_.leaf_size, grid_.depth - kCellLevel); }

 private:
  friend class EmptyCarver;
  friend class EmptyProjector;
  // One bit per node in Morton order (x in the lowest of three bits): byte m of a level holds the eight children of
  // node m of the level above.
  using Level = std::vector<uint8_t>;
  void settle();  // updates the levels above blocks where dirty_ is set
  void fold_level(int level, size_t first, size_t count);
  static constexpr int kDirtyLevel = 5, kDirtyShift = 3 * (kBlockLevel - kDirtyLevel);
  void note_block(uint32_t block) { dirty_[block >> kDirtyShift] = 1, any_dirty_ = true; }
  void set_block_range(const glm::ivec3& lo, const glm::ivec3& hi, uint8_t cells);
  void see(points::ClusterKey key, const points::Mosaic& mosaic);

  points::ModelConfig model_;
  points::OctreeGrid grid_;
  std::array<Level, kCellLevel + 1> any_;     // some cell of the node is unseen; the last one holds the cells
  std::array<Level, kBlockLevel + 1> hides_;  // some block of the node is unseen
  std::array<Level, kBlockLevel + 1> all_;    // all cells of the node are unseen
  std::vector<uint8_t> dirty_;                // one per node of kDirtyLevel
  bool any_dirty_ = false;
  std::vector<uint64_t> occupied_;  // kept for its memory
};

}  // namespace telesplat::packer
