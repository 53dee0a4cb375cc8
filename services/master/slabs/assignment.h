// The assignment sheet of a partition (T5.3): which slices each sampler fetches from which data server, in which round.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/result.h"
#include "services/master/slabs/partition.h"
#include "services/master/slabs/scene.h"

namespace telesplat::master {

// Schedules transfers from many senders to many receivers in rounds (T5.3): an edge colouring of the bipartite
// multigraph of transfers.
//
// Rounds: by Koenig's theorem (D. Koenig, "Ueber Graphen und ihre Anwendung auf Determinantentheorie und Mengenlehre",
// Math. Annalen 77, 1916) as many rounds as the busiest node has transfers are necessary, and enough for no node to
// have two in a round. The proof is the algorithm: transfers are coloured one by one, and if no colour is free at both
// ends, the path of two alternating colours from one end is swapped. T figure 5.1 shows three rounds, though one
// receiver gets four transfers: two of these share a round there (sheet (d): A1 and A4 both send to B2); `rounds` asks
// for such sheets.
//
// Time: a round takes as long as its longest transfer. Transfers are coloured in order of their bytes, lowest colour
// first, so that large ones share rounds; then pairs of rounds are improved: their transfers make paths and cycles,
// each of them can swap its rounds alone, and it is best to have the larger side of each in the same round. (The best
// colouring of all is NP-hard to find: D. de Werra et al., "Weighted coloring on planar, bipartite and split graphs",
// Discrete Applied Mathematics 157, 2009.)

inline constexpr size_t kMaxScatterNodes = 4096;          ///< limit of senders, and of receivers
inline constexpr size_t kMaxTransfers = size_t{1} << 16;  ///< transfers of a sheet, at most

/// A transfer between two nodes; two nodes have several if a large one was cut.
struct Transfer {
  uint32_t sender = 0, receiver = 0;
  uint64_t bytes = 0;
  bool operator==(const Transfer&) const = default;
};

struct AssignmentSheet {
  std::vector<uint32_t> round;  ///< round of each transfer, from 0
  uint32_t rounds = 0;

  /// Sum over the rounds of their longest transfers, bytes.
  uint64_t makespan(std::span<const Transfer> transfers) const;
};

/// The largest number of transfers of a node.
uint32_t busiest(std::span<const Transfer> transfers);

/// Returns a sheet of busiest() rounds, in which no node has two transfers in a round. rounds above 0: their number at
/// most; a node of more transfers then has them spread over the rounds as evenly as can be. weighted: false ignores
/// the bytes. Error: too many nodes or transfers.
Result<AssignmentSheet> schedule_scatter(std::span<const Transfer> transfers, uint32_t rounds = 0,
                                         bool weighted = true);

/// Error: the sheet has another number of transfers, a round that does not exist, or a node with more transfers in a
/// round than necessary.
Status validate(const AssignmentSheet& sheet, std::span<const Transfer> transfers);

/// Transfers that are expected to be larger are cut at slices: they share their rounds with others better, and stay far
/// below what a message may hold.
inline constexpr uint64_t kLargestTransfer = 32u << 20;

struct AssignedTransfer {
  size_t server = 0, slab = 0;  ///< index in the scene's servers, in the partition's slabs
  uint64_t round = 0;
  int begin = 0, end = 0;  ///< slices
  uint64_t bytes = 0;      ///< expected
};

/// Returns all transfers of the slabs' slices and one slice more on both sides, by rounds. No server sends and no
/// sampler receives twice in a round. A slab has at most wire::kMaxSlabs transfers.
std::vector<AssignedTransfer> assignment(const Partition& partition, const VolumeScene& scene);

}  // namespace telesplat::master
