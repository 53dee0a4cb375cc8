// Levels above the cluster: a block's clusters as one mosaic, for views in which a block spans few pixels. A summary is made from the model and is no part
// of it: whoever draws makes it when it is worth it.
#pragma once

#include <memory>

#include "common/points/point_model.h"

namespace telesplat::points {

/// No summary has more samples across its block.
inline constexpr float kMostSummaryRange = 48;
/// A block that has no more points is summarised by all of them.
inline constexpr uint64_t kMostSummaryPoints = 4096;

struct Summary {
  Cluster cluster;       ///< its leaf is the block's cube; one mosaic. Its key is the block's with kSummaryKey set
  Sequence built;        ///< the model's newest event then: mosaics with a later sequence are not in it
  uint64_t changes = 0;  ///< Block::changes then
  uint64_t removals = 0;
  float most_range = 0;  ///< views in which the block spans more pixels need the clusters
};

/// In a cluster's key: names a block, not a leaf.
inline constexpr ClusterKey kSummaryKey = 1u << 31;

/// By block_key.
using Summaries = std::unordered_map<ClusterKey, std::unique_ptr<Summary>>;

/// All points of a block of few; else a point for each cell of the block's surface, with the mean colour of those in the cell (merge_mosaics). Cells are as large as the samples of the
/// block's most coarsely sampled cluster are apart, or as kMostSummaryRange asks for. applied: the model's newest event.
std::unique_ptr<Summary> summarise(const PointModel& model, ClusterKey block_key, const Block& block, Sequence applied);

}  // namespace telesplat::points
