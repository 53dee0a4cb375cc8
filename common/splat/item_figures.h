// Figures of a draw item that do not depend on its points' positions. Both renderers take them from here.
#pragma once

#include <array>

#include "common/splat/facing.h"
#include "common/splat/flat/splat_table.h"
#include "common/splat/kernel_traits.h"
#include "common/splat/pixel_key.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/splat_kernels.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::splat {

struct ItemFigures {
  uint32_t spacing = 0;             ///< spacing_class of its samples; 0 if the kernel is not smoothed
  const FlatSplat* flat = nullptr;  ///< flat kernels; lives as long as the FrameFigures
  SurfelSource source;              ///< surfel kernels
};

/// The figures of one frame's items, and the mean of their biases.
class FrameFigures {
 public:
  /// scale: DrawList::scale. Keeps only a reference to the kernel.
  FrameFigures(const KernelTraits& kernel, const geometry::Camera& camera, float scale);

  /// To be called once for each item: its bias counts in rim().
  ItemFigures add(const DrawItem& item);

  /// Mean bias on the contour for each class of spacing, weighted by points. Ellipses differ from point to point: the
  /// bias at the centre of the item's leaf represents them, and items whose centre is nearer than the near plane do not
  /// count.
  RimBias rim() const;

 private:
  void add_bias(uint32_t spacing, double bias, uint32_t points) {
    bias_[spacing] += bias * points;
    points_[spacing] += points;
  }

  const KernelTraits& kernel_;
  const float scale_, near_m_;
  const SurfelCamera camera_;
  const glm::dvec4 depth_row_;
  std::array<FlatSplat, kMaxSplatSide * 4 + 1> flat_;  // by size in quarters of a pixel
  std::array<double, 4> bias_{}, points_{};
};

/// Consecutive draw items of one cluster share their leaf's transform and their place in the tiles.
struct ItemRuns {
  std::vector<ItemRun> runs;
  std::vector<LeafTransform> transforms;  ///< one a run
  std::vector<glm::vec3> facing;          ///< one a run: facing_vector

  void build(const std::vector<DrawItem>& items, const geometry::Camera& camera) {
    build(items);
    const auto room_to_pixel = camera.room_to_pixel();
    const glm::vec3 eye(camera.pose.position_room);
    for (size_t i = 0; i < runs.size(); ++i) transform(i, items, room_to_pixel, eye);
  }

  /// The same in two steps: build() once, then transform() for each run, in any order and on any thread.
  void build(const std::vector<DrawItem>& items) {
    runs.clear();
    const points::Cluster* cluster = nullptr;
    for (uint32_t i = 0; i < items.size(); ++i) {
      if (items[i].cluster != cluster) {
        cluster = items[i].cluster;
        runs.push_back({i, i});
      }
      runs.back().last = i + 1;
    }
    transforms.resize(runs.size());
    facing.resize(runs.size());
  }
  /// Takes the runs of `other`, for another view of the same items.
  void like(const ItemRuns& other) {
    runs = other.runs;
    transforms.resize(runs.size());
    facing.resize(runs.size());
  }
  void transform(size_t run, const std::vector<DrawItem>& items, const geometry::Camera::PixelTransform& room_to_pixel,
                 const glm::vec3& eye_room) {
    const ItemRun& r = runs[run];
    const geometry::Box& leaf = items[r.first].cluster->leaf_room;
    transforms[run] = leaf_transform(room_to_pixel, leaf);
    facing[run] = glm::vec3(0);
    for (uint32_t i = r.first; i < r.last; ++i) {
      if (!items[i].may_face_away) continue;
      facing[run] = facing_vector(leaf_view(leaf, eye_room));
      break;
    }
  }
};

}  // namespace telesplat::splat
