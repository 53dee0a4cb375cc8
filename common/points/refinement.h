// Points that came with bounded errors become exact: each is found by what it is, and replaced where it lies.
//
// Merging copies points and never changes them (compaction.h), so a point of a bounded patch is in its cluster as it
// came, whatever was merged since. What replaces it stays in that cluster: one whose exact position lies beyond the
// leaf's side comes to lie on it, within the error that it had.
//
// The rule looks at nothing but the cluster, the bounded patch and the exact one. So packer and viewers, which apply
// the same events, hold the same bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/points/point_model.h"

namespace telesplat::points {

/// What a refinement says of each cluster, ready to be applied. Made without touching a model.
struct PreparedRefinement {
  struct Part {
    ClusterKey key;
    std::vector<LeafPoint> bounded, exact;  ///< bounded[i] becomes exact[i]; they differ
  };
  Sequence sequence;        ///< of the event that brings it
  Sequence of;              ///< of the patch that it refines
  uint32_t group = 0;       ///< of that patch: Mosaic::group()
  std::vector<Part> parts;  ///< ascending keys
  uint64_t points() const;
};

/// camera, tile, frame: of the patch, as prepare_patch() takes them. bounded, exact: the patch's image as it was
/// published, and as it was sampled; pixels that only one of them covers are left out.
/// Preconditions: as prepare_patch(); both images of the tile's size.
PreparedRefinement prepare_refinement(const ModelConfig& config, Sequence sequence, Sequence of,
                                      const geometry::Camera& camera, const geometry::Rect& tile,
                                      const image::DepthImage& bounded, const image::DepthImage& exact,
                                      FrameId frame = {});

/// What it does to the model (PointModel::commit): mosaics with such points are made anew in their places, with the
/// sequence and the frame that they had. Clusters and points that are not there are passed over. Of points that are
/// alike the first that is found becomes the first exact one, and so on.
Insertion plan_refinement(const PointModel& model, const PreparedRefinement& refinement);

}  // namespace telesplat::points
