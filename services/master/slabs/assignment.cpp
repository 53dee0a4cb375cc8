#include "services/master/slabs/assignment.h"

#include <algorithm>

#include "common/core/check.h"
#include "services/master/slabs/scatter_schedule.h"

namespace telesplat::master {

std::vector<AssignedTransfer> assignment(const Partition& partition, const VolumeScene& scene) {
  const int slices = scene.session().grid.size[2];
  // A sheet has at most kMaxTransfers entries and a message at most wire::kMaxSlabs; huge volumes get larger pieces
  // instead of more.
  const size_t most_pieces =
      std::max<size_t>(1, std::min(kMaxTransfers / (2 * partition.slabs.size() + scene.servers().size()),
                                   wire::kMaxSlabs / (2 * scene.servers().size())));
  std::vector<AssignedTransfer> out;
  for (size_t s = 0; s < partition.slabs.size(); ++s) {
    const SlabRange slab = partition.slabs[s].range;
    for (size_t d = 0; d < scene.servers().size(); ++d) {
      const auto& server = scene.servers()[d];
      const int begin = std::max({slab.begin - 1, server.begin, 0}), end = std::min({slab.end + 1, server.end, slices});
      if (begin >= end) continue;
      const uint64_t bytes = scene.bytes(server, begin, end);
      const size_t pieces = std::min({size_t(1 + bytes / kLargestTransfer), size_t(end - begin), most_pieces});
      for (size_t p = 0; p < pieces; ++p) {
        const auto at = [&](size_t i) { return begin + int(size_t(end - begin) * i / pieces); };
        out.push_back(
            {.server = d, .slab = s, .begin = at(p), .end = at(p + 1), .bytes = scene.bytes(server, at(p), at(p + 1))});
      }
    }
  }
  std::vector<Transfer> transfers;
  for (const auto& t : out) transfers.push_back({uint32_t(t.server), uint32_t(t.slab), t.bytes});
  const auto sheet = schedule_scatter(transfers);
  CHECK(sheet);  // partitions and parts are within its limits
  for (size_t i = 0; i < out.size(); ++i) out[i].round = sheet->round[i];
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.round < b.round; });
  return out;
}

}  // namespace telesplat::master
