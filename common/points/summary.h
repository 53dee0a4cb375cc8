// Levels above the cluster: a brick's clusters as one mosaic, for views in which a brick spans few pixels. A summary is
// made from the model and is no part of it: whoever draws makes it when it is worth it.
#pragma once

#include <memory>

#include "common/points/point_model.h"

namespace telesplat::points {

/// No summary has more samples across its brick.
inline constexpr float kMostSummaryRange = 48;
/// A brick that has no more points is summarised by all of them.
inline constexpr uint64_t kMostSummaryPoints = 4096;

struct Summary {
  Cluster cluster;       ///< its leaf is the brick's cube; one mosaic. Its key is the brick's with kSummaryKey set
  Sequence built;        ///< the model's newest event then: mosaics with a later sequence are not in it
  uint64_t changes = 0;  ///< Brick::changes then
  uint64_t removals = 0;
  uint64_t bytes() const { return sizeof(Summary) + cluster.mosaics.front().bytes(); }
  float most_range = 0;  ///< views in which the brick spans more pixels need the clusters
};

/// In a cluster's key: names a brick, not a leaf.
inline constexpr ClusterKey kSummaryKey = 1u << 31;

/// By brick_key.
using Summaries = std::unordered_map<ClusterKey, std::unique_ptr<Summary>>;

/// All points of a brick of few; else a point for each cell of the brick's surface, with the mean colour of those in
/// the cell (merge_mosaics). Cells are as large as the samples of the brick's most coarsely sampled cluster are apart,
/// or as kMostSummaryRange asks for. applied: the model's newest event.
std::unique_ptr<Summary> summarise(const PointModel& model, ClusterKey brick_key, const Brick& brick, Sequence applied);

}  // namespace telesplat::points
