// The other design that was weighed for the point cache (docs/cache.md), as far as it takes to measure it: a
// hierarchical surfel grid. A sample goes to the cell of its cluster whose size fits its footprint. A cell holds one
// sample, the first; a finer sample in it takes its place. Based on: M. Schuetz, L. Herzberger, M. Wimmer, "SimLOD:
// Simultaneous LOD generation and rendering for point clouds", 2024 (its voxels).
#pragma once

#include <unordered_map>
#include <unordered_set>

#include "common/points/point_model.h"

namespace telesplat::launcher {

class SurfelGrid {
 public:
  explicit SurfelGrid(const points::ModelConfig& config) : config_(config) {}

  /// Every sample of a view, none eliminated.
  void add(const points::PreparedPatch& view);
  /// Its samples as a point model: of each cluster a mosaic for each size of cells.
  points::PointModel model() const;
  size_t points() const { return cells_.size(); }

 private:
  struct Sample {
    uint16_t x, y, z, normal;
    uint32_t colour;
  };
  points::ModelConfig config_;
  std::unordered_map<uint64_t, Sample> cells_;
  std::unordered_set<uint64_t> refined_;  // cells in which there is a finer sample
};

}  // namespace telesplat::launcher
