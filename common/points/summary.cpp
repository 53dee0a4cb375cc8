#include "common/points/summary.h"

#include <algorithm>

#include "common/points/compaction.h"

namespace telesplat::points {

std::unique_ptr<Summary> summarise(const PointModel& model, ClusterKey brick_key, const Brick& brick,
                                   Sequence applied) {
  // Number of leaves along the brick's edge.
  const int shift = std::min(2, model.config().depth);
  const auto leaves = static_cast<float>(1 << shift);
  float range = kMostSummaryRange;
  for (const Cluster* cluster : brick.clusters) {
    float finest = 0;
    for (const Mosaic& m : cluster->mosaics) finest = std::max(finest, m.pixel_range());
    range = std::min(range, leaves * finest);
  }
  uint64_t points = 0;
  double range_sum = 0;
  for (const Cluster* cluster : brick.clusters)
    for (const Mosaic& m : cluster->mosaics) {
      points += m.count(0);
      range_sum += static_cast<double>(m.count(0)) * static_cast<double>(m.pixel_range());
    }
  // If there are few points, takes all of them.
  const bool all = points <= kMostSummaryPoints;
  std::vector<PlacedLevel> parts;
  for (const Cluster* cluster : brick.clusters) {
    const auto place = [&](int axis) { return static_cast<uint16_t>(cluster->key >> (10 * axis) & 3); };
    for (const Mosaic& m : cluster->mosaics) {
      // Finds the coarsest level that has a point for each cell.
      int level = 0;
      while (!all && level + 1 < kLevels && leaves * m.pixel_range() >= range * static_cast<float>(2 << level)) ++level;
      parts.push_back({&m, level, place(0), place(1), place(2)});
    }
  }
  auto out = std::make_unique<Summary>();
  out->cluster = {brick_key | kSummaryKey, brick.box_room, {}};
  if (all) {
    const auto mean = leaves * static_cast<float>(range_sum / static_cast<double>(points));
    out->cluster.mosaics.push_back(merge_levels(parts, shift, mean, applied));
  } else {
    out->cluster.mosaics.push_back(representatives(parts, shift, range, applied));
  }
  out->built = applied;
  out->changes = brick.changes;
  out->removals = brick.removals;
  out->most_range = all ? kMostSummaryRange : range;
  return out;
}

}  // namespace telesplat::points
