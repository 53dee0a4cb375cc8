// Walks the clusters of a model that a view may show, brick by brick.
#pragma once

#include <hwy/cache_control.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <vector>

#include "common/geometry/camera.h"
#include "common/points/point_model.h"

namespace telesplat::splat {

/// A brick that the frustum meets; bricks are sorted, nearest first.
struct SeenBrick {
  float distance2;
  bool whole;  ///< the brick lies wholly inside the frustum
  points::ClusterKey key;
  const points::Brick* brick;
};
inline std::vector<SeenBrick> seen_bricks(const points::PointModel& model, const geometry::Frustum& frustum,
                                          const glm::vec3& eye) {
  std::vector<SeenBrick> out;
  for (const auto& [key, brick] : model.bricks()) {
    if (!frustum.may_contain(brick->box_room)) continue;
    const glm::vec3 between = brick->box_room.centre() - eye;
    out.push_back({glm::dot(between, between), frustum.contains(brick->box_room), key, brick.get()});
  }
  std::sort(out.begin(), out.end(), [](const SeenBrick& a, const SeenBrick& b) { return a.distance2 < b.distance2; });
  return out;
}

/// Calls visit(cluster) for each cluster of a brick that the frustum meets. Prefetches the next ones, since clusters
/// lie scattered in memory.
template <class Visit>
void for_seen_clusters(const SeenBrick& seen, const geometry::Frustum& frustum, const Visit& visit) {
  constexpr size_t kClustersAhead = 8, kMosaicsAhead = 4;
  const auto& clusters = seen.brick->clusters;
  for (size_t i = 0; i < clusters.size(); ++i) {
    if (i + kClustersAhead < clusters.size()) hwy::Prefetch(clusters[i + kClustersAhead]);
    if (i + kMosaicsAhead < clusters.size()) hwy::Prefetch(clusters[i + kMosaicsAhead]->mosaics.data());
    const points::Cluster& cluster = *clusters[i];
    if (seen.whole || frustum.may_contain(cluster.leaf_room)) visit(cluster);
  }
}

}  // namespace telesplat::splat
