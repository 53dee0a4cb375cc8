// How many rays of a view may make finer what is shown already.
#pragma once

#include <algorithm>
#include <cstdint>

namespace telesplat::master {

/// A head that comes nearer, or a viewer that asks for finer views, makes rays useful in most pixels at once. All of
/// them in one view would keep the next views waiting; so a view gets as many as fit into its time, the middle first,
/// and the following ones get the rest. The number follows how long views take.
class RefiningRays {
 public:
  /// From a view's plan to its last tile.
  static constexpr double kTarget_s = 0.04;
  /// Times as many rays at edges as elsewhere (PlanRequest::most_rays).
  static constexpr double kEdges = 4;
  static constexpr double kLeast = 4096, kFirst = 16384, kMost = 1 << 24;

  /// Of all samplers together; at least one.
  uint64_t most(size_t samplers) const { return uint64_t(std::clamp(each_ * double(samplers), kLeast, kMost)); }

  /// A view is complete. refining: its rays that were such, of those at edges a kEdges-th; put_off: those that were
  /// left to later views.
  void learn(double took_s, double refining, double put_off, size_t samplers) {
    if (took_s > 1.5 * kTarget_s && 2 * refining > double(most(samplers)))
      each_ *= 0.7;
    else if (took_s < kTarget_s && put_off > 0)
      each_ *= 1.25;
    each_ = std::clamp(each_, kLeast / double(samplers), kMost);
  }

 private:
  double each_ = kFirst;  // sampler
};

}  // namespace telesplat::master
