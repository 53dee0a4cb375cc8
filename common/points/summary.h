// Levels above the cluster: a brick's clusters as one mosaic, for views in which a brick spans few pixels. A summary is
// made from the model and is not part of it: the renderer makes it when it pays.
#pragma once

#include <memory>

#include "common/points/point_model.h"

namespace telesplat::points {

/// Most samples across a summary's brick.
inline constexpr float kMostSummaryRange = 48;
/// A brick with at most this many points is summarised by all of them.
inline constexpr uint64_t kMostSummaryPoints = 4096;

struct Summary {
  Cluster cluster;       ///< its leaf is the brick's cube; one mosaic. Its key is the brick's with kSummaryKey set
  Sequence built;        ///< the model's newest event at that time: later mosaics are missing
  uint64_t changes = 0;  ///< Brick::changes at that time
  uint64_t removals = 0;
  uint64_t bytes() const { return sizeof(Summary) + cluster.mosaics.front().bytes(); }
  float most_range = 0;  ///< if the brick spans more pixels, its clusters are needed
};

/// Bit in a cluster's key: the key names a brick, not a leaf.
inline constexpr ClusterKey kSummaryKey = 1u << 31;

/// Summaries by brick_key.
using Summaries = std::unordered_map<ClusterKey, std::unique_ptr<Summary>>;

/// Takes all points of a brick that has few; else one for each cell of the brick's surface, with the mean colour of the
/// cell's points (merge_mosaics). Cells are as large as the sample distance of the brick's most coarsely sampled
/// cluster, or larger, by kMostSummaryRange. applied: the model's newest event.
std::unique_ptr<Summary> summarise(const PointModel& model, ClusterKey brick_key, const Brick& brick, Sequence applied);

}  // namespace telesplat::points
