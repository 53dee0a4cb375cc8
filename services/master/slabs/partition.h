// Shares a volume out among samplers: cuts it into slabs of slices, and makes one partition after the other as samplers
// come and go and slices change (T5.1, T7.4). No sockets, no clocks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::master {

inline constexpr double kUneven = 1.5;  ///< a slab heavier than this many means is cut anew
/// If only weights changed, a new partition comes no sooner than this after the one before.
inline constexpr double kRecutAfter_s = 2.0;
/// If nothing can be shown meanwhile, a partition is waited for no longer than this.
inline constexpr double kReadyPatience_s = 2.0;

struct SlabRange {
  int begin = 0, end = 0;  ///< slices, not empty
  bool operator==(const SlabRange&) const = default;
};

/// Cuts slices [0, weights.size()) into at most `parts` ranges, in order and without gaps, each with a slice of
/// weight above 0, such that the heaviest is as light as can be, and the others near the mean where that allows it.
/// Fewer ranges if fewer slices weigh anything; one if no slice does. Precondition: weights not empty, parts >= 1.
std::vector<SlabRange> cut_slabs(std::span<const uint32_t> weights, int parts);

struct Slab {
  std::string sampler;
  SlabRange range;
  uint64_t weight = 0;  ///< weight when it was cut
  bool ready = false;
  uint64_t voxels = 0, bytes = 0;  ///< held and received, as its sampler reported when ready
};

struct Partition {
  uint64_t number = 0;
  double made_s = 0;
  std::vector<Slab> slabs;
  std::vector<std::string> spare;  ///< samplers for which there was no slab

  bool ready() const;
  /// Index of the sampler's slab; nullopt: it has no slab.
  std::optional<size_t> slab_of(const std::string& sampler) const;
};

class SlabPartitions {
 public:
  /// Begins another volume and forgets everything except the samplers. Precondition: slices >= 1.
  void set_slices(int slices);
  /// Sets the weight of each slice. Error: the volume has another number of slices; the weights stay.
  Status set_weights(std::vector<uint32_t> weights);
  std::span<const uint32_t> weights() const { return weights_; }

  /// Adds a sampler, unless it is here already.
  void join(const std::string& sampler);
  void leave(const std::string& sampler);
  bool has(const std::string& sampler) const;
  /// The newest assignment does not hold any more (a data server has another address): a new partition follows.
  void invalidate() { changed_ = true; }

  /// Makes a new partition if samplers changed or the slabs became uneven, and takes the newest one into use when all
  /// its samplers are ready, or after kReadyPatience_s if no partition is in use. Returns the new partition, to be
  /// sent to its samplers. nullptr: no new one.
  std::shared_ptr<const Partition> update(double now_s);
  /// The sampler holds its slab. Ignored: unknown partitions, samplers without a slab in it.
  void ready(const std::string& sampler, uint64_t number, uint64_t voxels, uint64_t bytes);

  /// The partition for frames that begin now; all its samplers are here. nullptr: there is no such partition.
  std::shared_ptr<const Partition> in_use() const { return in_use_; }
  std::shared_ptr<const Partition> newest() const { return newest_; }
  uint64_t made() const { return made_; }

 private:
  bool uneven() const;
  bool all_here(const Partition& p) const;

  std::vector<uint32_t> weights_;
  std::vector<std::string> samplers_;  // in order of their slabs
  std::shared_ptr<Partition> newest_, in_use_;
  bool changed_ = false;                // a new partition is needed
  std::optional<double> none_since_s_;  // since then no partition was ready for use
  uint64_t made_ = 0;
};

}  // namespace telesplat::master
