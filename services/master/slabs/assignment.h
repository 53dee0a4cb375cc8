// The assignment sheet of a partition (T5.3): which slices each sampler fetches from which data server, in which round.
#pragma once

#include <vector>

#include "services/master/slabs/partition.h"
#include "services/master/slabs/scene.h"

namespace telesplat::master {

/// Transfers that are expected to be larger are cut at slices: they share their rounds with others better, and stay far
/// below what a message may hold.
inline constexpr uint64_t kLargestTransfer = 32u << 20;

struct AssignedTransfer {
  size_t server = 0, slab = 0;  ///< of the scene, of the partition
  uint64_t round = 0;
  int begin = 0, end = 0;  ///< slices
  uint64_t bytes = 0;      ///< expected
};

/// All transfers of the slabs' slices, one slice more on both sides, by rounds. No server sends and no sampler receives
/// twice in a round. A slab has at most wire::kMaxSlabs.
std::vector<AssignedTransfer> assignment(const Partition& partition, const VolumeScene& scene);

}  // namespace telesplat::master
