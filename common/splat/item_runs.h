// Consecutive draw items of one cluster share their leaf's transform and their place in the tiles.
#pragma once

#include "common/splat/facing.h"
#include "common/splat/splat_kernels.h"

namespace telesplat::splat {

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
  /// The same for another view of the items that `other` was built for.
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
