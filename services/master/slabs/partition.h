// How a volume is shared out among samplers: slabs of slices, and one partition after the other as samplers come, go
// and slices change (T5.1, T7.4). No sockets, no clocks.
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
inline constexpr double kRecutAfter_s =
    2.0;  ///< not sooner than this after the partition before, if only weights changed
inline constexpr double kReadyPatience_s =
    2.0;  ///< where nothing can be shown meanwhile, a partition is not waited for longer

struct SlabRange {
  int begin = 0, end = 0;  ///< slices, not empty
  bool operator==(const SlabRange&) const = default;
};

/// Cuts slices [0, weights.size()) into at most `parts` ranges, in order and without gaps, each with at least one slice
/// of weight above 0, such that the heaviest is as light as can be, and the others near the mean where that allows it.
/// Fewer ranges where fewer slices weigh anything; one where none does. Precondition: weights not empty, parts >= 1.
std::vector<SlabRange> cut_slabs(std::span<const uint32_t> weights, int parts);

struct Slab {
  std::string sampler;
  SlabRange range;
  uint64_t weight = 0;  ///< when it was cut
  bool ready = false;
  uint64_t voxels = 0, bytes = 0;  ///< as its sampler said when ready: held, received
};

struct Partition {
  uint64_t number = 0;
  double made_s = 0;
  std::vector<Slab> slabs;
  std::vector<std::string> spare;  ///< samplers for which there was no slab

  bool ready() const;
  /// nullopt: it has none.
  std::optional<size_t> slab_of(const std::string& sampler) const;
};

class SlabPartitions {
 public:
  /// Another volume, of N slices: everything but the samplers is forgotten. Precondition: slices >= 1.
  void set_slices(int slices);
  /// One a slice. Error: another number of them; the weights stay.
  Status set_weights(std::vector<uint32_t> weights);
  std::span<const uint32_t> weights() const { return weights_; }

  /// Twice the same: nothing happens.
  void join(const std::string& sampler);
  void leave(const std::string& sampler);
  bool has(const std::string& sampler) const;
  /// What the samplers were told is not true any more (a data server has another address): a new partition follows.
  void invalidate() { changed_ = true; }

  /// Makes a new partition if samplers changed or the slabs became uneven, and takes the newest one into use when all
  /// its samplers are ready, or when that takes long and there is none to use. Returns the new partition: its samplers
  /// are to be told. nullptr: no new one.
  std::shared_ptr<const Partition> update(double now_s);
  /// Ignored: unknown partitions, samplers without a slab in it.
  void ready(const std::string& sampler, uint64_t number, uint64_t voxels, uint64_t bytes);

  /// For frames that begin now; none of its samplers is gone. nullptr: there is none yet.
  std::shared_ptr<const Partition> in_use() const { return in_use_; }
  std::shared_ptr<const Partition> newest() const { return newest_; }
  uint64_t made() const { return made_; }

 private:
  bool uneven() const;
  bool all_here(const Partition& p) const;

  std::vector<uint32_t> weights_;
  std::vector<std::string> samplers_;  // in order of their slabs
  std::shared_ptr<Partition> newest_, in_use_;
  bool changed_ = false;                // something that asks for a new partition
  std::optional<double> none_since_s_;  // since when there is none to use, or only one that was not waited for
  uint64_t made_ = 0;
};

}  // namespace telesplat::master
