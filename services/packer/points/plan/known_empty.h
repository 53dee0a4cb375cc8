// Which space rays have passed through or found a surface in, and which nobody has seen: what is unseen may hide
// something. Space carving (Kutulakos and Seitz 2000, "A Theory of Shape by Space Carving") with depths: a cell is seen
// once every ray of a view that passes it went on behind it.
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

/// A bit a cell of 256^3 over the octree's cube: 1 = unseen. 2x2x2 cells are a block; only a block of unseen cells
/// alone counts as something that can hide something, so that slivers beside edges cost no rays.
/// What lies outside of the data set's box is seen from the beginning: nothing is there.
class KnownEmpty {
 public:
  static constexpr int kCellLevel = 8, kBlockLevel = kCellLevel - 1;
  /// Blocks around points and cells at an image's border count as seen up to this length in pixels; without them rays
  /// that graze a surface would be cast again and again. Longer ones, as near a head within the data, stay unseen: they
  /// may hold surfaces that no ray has met.
  static constexpr float kFewPixels = 8;

  /// Precondition: points::validate(model).
  explicit KnownEmpty(const points::ModelConfig& model);

  /// A new epoch: nothing inside the data set's box was seen.
  void clear();

  /// Points came: the blocks that hold them are seen, and those around, as far as the points lie apart and, where a
  /// block is no longer than kFewPixels points, one more.
  void add(const points::PreparedPatch& patch);
  /// The same of everything in a model.
  void add(const points::PointModel& model);

  /// Clusters went: nobody knows what is in their leaves.
  void forget(std::span<const points::ClusterKey> clusters);

  /// Rays hit here though nothing was expected: three blocks around each point become unseen, so that the next views
  /// look at all of them. (Points that are added later make their surroundings seen again: add() first.)
  void refill(std::span<const glm::vec3> points_room);

  /// What a view has seen. clear_m: of each pixel of `camera` the depth up to which its ray is known to have met
  /// nothing: 0 where it was not cast, +infinity where it missed or passes seen space alone, else the depth of what it
  /// hit, or of what the model shows there (and nothing unseen is before it). Negative: clear as far as -clear_m, but
  /// this is nothing new: what only such rays pass is not looked at, so that the cost follows the new ones. Call it
  /// after add() of the points that the rays found. Precondition: validate(camera), clear_m of its size.
  void carve(const geometry::Camera& camera, std::span<const float> clear_m, int threads);

  /// Sets the pixels of `camera` whose rays pass unseen blocks before shown_m, the depth of what the model shows there
  /// (+infinity: nothing; negative: not asked for). So a pixel that shows nothing and is not set is known empty, and
  /// one that shows a surface and is set may have something before it. Conservative by a pixel or two at most.
  /// may_hold becomes a mask of the camera's size. Precondition: validate(camera), shown_m of its size.
  void project(const geometry::Camera& camera, std::span<const float> shown_m, int threads,
               image::PixelMask& may_hold) const;

  /// Whether no ray has looked into the cell around this place, as inside of what is solid. Outside the data set's box
  /// everything is seen.
  bool unseen_at(const glm::dvec3& room) const;

  /// For tests and records.
  bool unseen(const glm::ivec3& cell) const;
  uint64_t unseen_cells() const;
  double cell_m() const { return std::ldexp(grid_.leaf_size, grid_.depth - kCellLevel); }

 private:
  friend class EmptyCarver;
  friend class EmptyProjector;
  // A bit a node in Morton order (x in the low bit of three), so that the eight children of node m are byte m of the
  // next level.
  using Level = std::vector<uint8_t>;
  void settle();  // brings the levels above blocks up to date where dirty_ says so
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
  std::vector<uint8_t> dirty_;                // of each node of kDirtyLevel
  bool any_dirty_ = false;
  std::vector<uint64_t> occupied_;  // kept for its memory
};

}  // namespace telesplat::packer
