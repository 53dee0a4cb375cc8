// The figures of a draw item that do not depend on where its points lie. Both renderers take them from here.
#pragma once

#include <array>

#include "common/splat/flat/splat_table.h"
#include "common/splat/kernel_traits.h"
#include "common/splat/pixel_key.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/surfel/contour.h"

namespace telesplat::splat {

struct ItemFigures {
  uint32_t spacing = 0;             ///< spacing_class of its samples; 0 where the kernel is not smoothed
  const FlatSplat* flat = nullptr;  ///< flat kernels; lives as long as the FrameFigures
  SurfelSource source;              ///< surfel kernels
};

/// The figures of one frame's items, and the mean of their biases.
class FrameFigures {
 public:
  /// scale: DrawList::scale. Keeps a reference to the kernel alone.
  FrameFigures(const KernelTraits& kernel, const geometry::Camera& camera, float scale);

  /// To be called once for each item: its bias counts in rim().
  ItemFigures add(const DrawItem& item);

  /// Mean bias on the contour for each class of spacing, weighted by points. Ellipses differ from point to point: the
  /// bias at the item's leaf's centre stands for them, and items whose centre is nearer than the near plane do not
  /// count.
  RimBias rim() const;

 private:
  void add_bias(uint32_t spacing, double bias, uint32_t points) {
    bias_[spacing] += bias * points;
    points_[spacing] += points;
  }

  const KernelTraits& kernel_;
  const float scale_, near_m_;
  const SurfelCamera camera_;
  const glm::dvec4 depth_row_;
  std::array<FlatSplat, kMaxSplatSide * 4 + 1> flat_;  // by size in quarters of a pixel
  std::array<double, 4> bias_{}, points_{};
};

}  // namespace telesplat::splat
