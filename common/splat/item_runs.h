// Consecutive draw items of one cluster share their leaf's transform and their place in the tiles.
#pragma once

#include "common/splat/splat_kernels.h"

namespace telesplat::splat {

struct ItemRuns {
  std::vector<ItemRun> runs;
  std::vector<LeafTransform> transforms;  ///< one a run

  void build(const std::vector<DrawItem>& items, const geometry::Camera& camera) {
    runs.clear();
    transforms.clear();
    const auto room_to_pixel = camera.room_to_pixel();
    const points::Cluster* cluster = nullptr;
    for (uint32_t i = 0; i < items.size(); ++i) {
      if (items[i].cluster != cluster) {
        cluster = items[i].cluster;
        runs.push_back({i, i});
        transforms.push_back(leaf_transform(room_to_pixel, cluster->leaf_room));
      }
      runs.back().last = i + 1;
    }
  }
};

}  // namespace telesplat::splat
