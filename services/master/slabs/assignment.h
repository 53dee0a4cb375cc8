// The assignment sheet of a partition (T5.3): which slices each sampler fetches from which data server, in which round.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "services/master/slabs/partition.h"
#include "services/master/slabs/scene.h"

namespace telesplat::master {

// Who sends what to whom in which round, from many senders to many receivers (T5.3): an edge colouring of the bipartite
// multigraph of transfers.
//
// Rounds: by Koenig's theorem (D. Koenig, "Ueber Graphen und ihre Anwendung auf Determinantentheorie und Mengenlehre",
// Math. Annalen 77, 1916) the busiest node's number of transfers is enough rounds for no node to have two in a round,
// and necessary. The proof is the algorithm: transfers are coloured one by one, and where no colour is free at both
// ends, the path of two alternating colours from one end is swapped. T figure 5.1 shows three rounds for transfers of
// which one receiver gets four, so two of these share a round there (sheet (d): A1 and A4 both send to B2); `rounds`
// asks for such sheets.
//
// Time: a round takes as long as its longest transfer. Transfers are coloured in order of their bytes, lowest colour
// first, so that large ones share rounds; then pairs of rounds are improved: their transfers make paths and cycles that
// can change sides each for itself, and the best is to have the larger side of each in the same round. (The best
// colouring of all is NP-hard to find: D. de Werra et al., "Weighted coloring on planar, bipartite and split graphs",
// Discrete Applied Mathematics 157, 2009.)

inline constexpr size_t kMaxScatterNodes = 4096;          ///< senders, and receivers
inline constexpr size_t kMaxTransfers = size_t{1} << 16;  ///< of a sheet

/// Two nodes may have several: a large one that was cut.
struct Transfer {
  uint32_t sender = 0, receiver = 0;
  uint64_t bytes = 0;
  bool operator==(const Transfer&) const = default;
};

struct AssignmentSheet {
  std::vector<uint32_t> round;  ///< of each transfer, from 0
  uint32_t rounds = 0;

  /// Sum over the rounds of their longest transfers, bytes.
  uint64_t makespan(std::span<const Transfer> transfers) const;
};

/// The largest number of transfers of a node.
uint32_t busiest(std::span<const Transfer> transfers);

/// A sheet of busiest() rounds, in which no node has two transfers in a round. rounds above 0: at most that many
/// rounds; a node of more transfers then has them spread over the rounds as evenly as can be. weighted: false leaves
/// out what concerns the bytes. Error: too many nodes or transfers.
Result<AssignmentSheet> schedule_scatter(std::span<const Transfer> transfers, uint32_t rounds = 0,
                                         bool weighted = true);

/// Refuses sheets of another number of transfers, rounds that are not there, and nodes with more transfers in a round
/// than they must have.
Status validate(const AssignmentSheet& sheet, std::span<const Transfer> transfers);

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
