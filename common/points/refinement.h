// Makes points with bounded errors exact: finds each by its values, and replaces it in place.
//
// Merging copies points and never changes them (compaction.h), so a point of a bounded patch stays unchanged in its
// cluster through all merges. Its replacement stays in that cluster, too: if its exact position lies beyond the leaf's
// side, it is moved onto the side, within the error that it had.
//
// The rule depends only on the cluster, the bounded patch and the exact one. So packer and viewers, which apply the
// same events, hold the same bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/points/point_model.h"

namespace telesplat::points {

/// Changes by a refinement to each cluster, ready to be applied. Making it needs no model.
struct PreparedRefinement {
  struct Part {
    ClusterKey key;
    std::vector<LeafPoint> bounded, exact;  ///< bounded[i] becomes exact[i]; they differ
  };
  Sequence sequence;        ///< sequence of the event that brings it
  Sequence of;              ///< sequence of the patch that it refines
  uint32_t group = 0;       ///< group of that patch: Mosaic::group()
  std::vector<Part> parts;  ///< ascending keys
  uint64_t points() const;
};

/// A patch's image as it was published, and as it was sampled; camera, tile and frame as prepare_patch() takes them.
struct RefinedPatch {
  const geometry::Camera& camera;
  const geometry::Rect& tile;
  const image::DepthImage &bounded, &exact;
  FrameId frame{};
};

/// The event `sequence` refines the patch of the event `of`. Pixels that only one image covers are left out.
/// Preconditions: as prepare_patch(); both images of the tile's size.
PreparedRefinement prepare_refinement(const ModelConfig& config, Sequence sequence, Sequence of,
                                      const RefinedPatch& patch);

/// The changes to the model, for PointModel::commit: mosaics with such points are made anew in place, with the same
/// sequence and frame. Ignores missing clusters and points. If bounded points are equal, the first in the model becomes
/// the first exact one, and so on.
Insertion plan_refinement(const PointModel& model, const PreparedRefinement& refinement);

}  // namespace telesplat::points
