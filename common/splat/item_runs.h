// Consecutive draw items of one cluster share their leaf's transform and their place in the tiles.
#pragma once

#include "common/splat/splat_kernels.h"

namespace telesplat::splat {

struct ItemRuns {
  std::vector<ItemRun> runs;
  std::vector<LeafTransform> transforms;  ///< one a run

  void build(const std::vector<DrawItem>& items, const geometry::Camera& camera) {
    build(items);
    const auto room_to_pixel = camera.room_to_pixel();
    for (size_t i = 0; i < runs.size(); ++i) transform(i, items, room_to_pixel);
  }

  /// The same in two steps, the second of which can be taken for all runs at once.
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
  }
  void transform(size_t run, const std::vector<DrawItem>& items,
                 const geometry::Camera::PixelTransform& room_to_pixel) {
    transforms[run] = leaf_transform(room_to_pixel, items[runs[run].first].cluster->leaf_room);
  }
};

}  // namespace telesplat::splat
