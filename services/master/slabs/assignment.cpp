#include "services/master/slabs/assignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <numeric>
#include <unordered_map>

#include "common/core/check.h"

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

namespace {

constexpr uint32_t kNone = ~0u;
// Transfers that are looked at while rounds are improved, at most; bench master_scatter measures the time for it.
constexpr uint64_t kImproveSteps = 2'000'000;

uint64_t key(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

// A bipartite multigraph whose edges get colours.
class Colouring {
 public:
  // Splits a node of more than `colours` transfers into several nodes of at most `colours` transfers each.
  Colouring(std::span<const Transfer> transfers, uint32_t colours) : colours_(colours), words_((colours + 63) / 64) {
    std::map<std::array<uint32_t, 3>, uint32_t> nodes;
    std::map<std::array<uint32_t, 2>, uint32_t> seen;
    const auto node = [&](uint32_t side, uint32_t of) {
      const uint32_t copy = seen[{side, of}]++ / colours;
      return nodes.try_emplace({side, of, copy}, uint32_t(nodes.size())).first->second;
    };
    for (const Transfer& t : transfers) {
      const uint32_t sender = node(0, t.sender);
      edges_.push_back({{sender, node(1, t.receiver)}, t.bytes, kNone});
    }
    used_.assign(nodes.size() * words_, 0);
    at_.reserve(edges_.size() * 2);
  }

  void colour(uint32_t e) {
    const auto [u, v] = edges_[e].ends;
    uint32_t free = lowest_free(u, v);
    if (free == kNone) {
      // Colour a is free at u, b at v. The path of colours a, b, a, ... from v cannot end at u: it would arrive by a.
      const uint32_t a = lowest_free(u, u), b = lowest_free(v, v);
      recolour(path(v, a, b), a, b);
      free = a;
    }
    set(e, free);
  }

  void improve() {
    by_colour_.assign(colours_, {});
    for (uint32_t e = 0; e < edges_.size(); ++e) by_colour_[edges_[e].colour].push_back(e);
    marks_.assign(edges_.size(), 0);
    uint64_t steps = 0;
    bool better = true;
    while (better) {
      better = false;
      for (uint32_t a = 0; a < colours_; ++a)
        for (uint32_t b = a + 1; b < colours_; ++b) {
          steps += by_colour_[a].size() + by_colour_[b].size() + 1;
          if (steps > kImproveSteps) return;
          better |= improve(a, b);
        }
    }
  }

  uint32_t colour_of(uint32_t e) const { return edges_[e].colour; }

 private:
  struct Edge {
    std::array<uint32_t, 2> ends;
    uint64_t bytes;
    uint32_t colour;
  };

  uint32_t lowest_free(uint32_t u, uint32_t v) const {
    for (size_t w = 0; w < words_; ++w)
      if (const uint64_t free = ~(used_[u * words_ + w] | used_[v * words_ + w])) {
        const uint32_t colour = uint32_t(w * 64) + uint32_t(std::countr_zero(free));
        return colour < colours_ ? colour : kNone;
      }
    return kNone;
  }
  uint32_t edge_at(uint32_t node, uint32_t colour) const {
    const auto found = at_.find(key(node, colour));
    return found == at_.end() ? kNone : found->second;
  }
  void set(uint32_t e, uint32_t colour) {
    edges_[e].colour = colour;
    for (const uint32_t node : edges_[e].ends) {
      at_[key(node, colour)] = e;
      used_[node * words_ + colour / 64] |= uint64_t{1} << colour % 64;
    }
  }
  // Swaps colours a and b of these edges, which must be all edges of a path or cycle, or colours collide.
  void recolour(const std::vector<uint32_t>& edges, uint32_t a, uint32_t b) {
    for (const uint32_t e : edges)
      for (const uint32_t node : edges_[e].ends) {
        at_.erase(key(node, edges_[e].colour));
        used_[node * words_ + edges_[e].colour / 64] &= ~(uint64_t{1} << edges_[e].colour % 64);
      }
    for (const uint32_t e : edges) set(e, edges_[e].colour == a ? b : a);
  }
  std::vector<uint32_t> path(uint32_t from, uint32_t a, uint32_t b) const {
    std::vector<uint32_t> out;
    for (uint32_t e = edge_at(from, a); e != kNone; e = edge_at(from, a)) {
      out.push_back(e);
      from = edges_[e].ends[0] == from ? edges_[e].ends[1] : edges_[e].ends[0];
      std::swap(a, b);
    }
    return out;
  }

  // Marks and returns the path or cycle of the two colours to which e belongs.
  std::vector<uint32_t> component(uint32_t e, uint32_t a, uint32_t b) {
    std::vector<uint32_t> out{e};
    marks_[e] = mark_;
    for (size_t i = 0; i < out.size(); ++i) {
      const Edge& x = edges_[out[i]];
      for (const uint32_t node : x.ends)
        if (const uint32_t next = edge_at(node, x.colour == a ? b : a); next != kNone && marks_[next] != mark_) {
          marks_[next] = mark_;
          out.push_back(next);
        }
    }
    return out;
  }

  // Recolours the edges of two colours such that the sum of their two longest edges is the smallest possible. False: it
  // was so already.
  bool improve(uint32_t a, uint32_t b) {
    const auto longest = [&](const std::vector<uint32_t>& edges, uint32_t colour) {
      uint64_t most = 0;
      for (const uint32_t e : edges)
        if (edges_[e].colour == colour) most = std::max(most, edges_[e].bytes);
      return most;
    };
    std::vector<uint32_t> both = by_colour_[a];
    both.insert(both.end(), by_colour_[b].begin(), by_colour_[b].end());
    // The longest edge of all has one of the colours, say a; b's longest is then at least as long as that of the
    // smaller side of every component.
    std::vector<uint32_t> turned;
    uint64_t most_a = 0, most_b = 0;
    ++mark_;
    for (const uint32_t e : both) {
      if (marks_[e] == mark_) continue;
      const auto part = component(e, a, b);
      uint64_t in_a = longest(part, a), in_b = longest(part, b);
      if (in_b > in_a) {
        std::swap(in_a, in_b);
        turned.insert(turned.end(), part.begin(), part.end());
      }
      most_a = std::max(most_a, in_a);
      most_b = std::max(most_b, in_b);
    }
    if (most_a + most_b >= longest(both, a) + longest(both, b)) return false;
    recolour(turned, a, b);
    by_colour_[a].clear();
    by_colour_[b].clear();
    for (const uint32_t e : both) by_colour_[edges_[e].colour].push_back(e);
    return true;
  }

  uint32_t colours_;
  size_t words_;
  std::vector<Edge> edges_;
  std::vector<uint64_t> used_;                 // a bit for each colour, by node
  std::unordered_map<uint64_t, uint32_t> at_;  // the edge of a colour at a node
  std::vector<std::vector<uint32_t>> by_colour_;
  std::vector<uint64_t> marks_;  // mark_ of the search that last reached each edge
  uint64_t mark_ = 0;
};

std::map<std::array<uint32_t, 2>, uint32_t> degrees(std::span<const Transfer> transfers) {
  std::map<std::array<uint32_t, 2>, uint32_t> out;
  for (const Transfer& t : transfers) ++out[{0, t.sender}], ++out[{1, t.receiver}];
  return out;
}

}  // namespace

uint64_t AssignmentSheet::makespan(std::span<const Transfer> transfers) const {
  std::vector<uint64_t> longest(rounds, 0);
  for (size_t i = 0; i < transfers.size(); ++i) longest[round[i]] = std::max(longest[round[i]], transfers[i].bytes);
  return std::accumulate(longest.begin(), longest.end(), uint64_t{0});
}

uint32_t busiest(std::span<const Transfer> transfers) {
  uint32_t most = 0;
  for (const auto& [node, degree] : degrees(transfers)) most = std::max(most, degree);
  return most;
}

Result<AssignmentSheet> schedule_scatter(std::span<const Transfer> transfers, uint32_t rounds, bool weighted) {
  if (transfers.size() > kMaxTransfers)
    return Error{fmt::format("a sheet of {} transfers, limit {}", transfers.size(), kMaxTransfers)};
  for (const Transfer& t : transfers)
    if (t.sender >= kMaxScatterNodes || t.receiver >= kMaxScatterNodes)
      return Error{
          fmt::format("a transfer from node {} to node {}, limit {} each", t.sender, t.receiver, kMaxScatterNodes - 1)};
  AssignmentSheet out;
  out.rounds = busiest(transfers);
  if (rounds > 0) out.rounds = std::min(out.rounds, rounds);
  if (transfers.empty()) return out;
  std::vector<uint32_t> order(transfers.size());
  std::iota(order.begin(), order.end(), 0u);
  if (weighted)
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return transfers[a].bytes > transfers[b].bytes; });
  Colouring colouring(transfers, out.rounds);
  for (const uint32_t e : order) colouring.colour(e);
  if (weighted) colouring.improve();
  for (uint32_t e = 0; e < transfers.size(); ++e) out.round.push_back(colouring.colour_of(e));
  return out;
}

Status validate(const AssignmentSheet& sheet, std::span<const Transfer> transfers) {
  if (sheet.round.size() != transfers.size())
    return Error{fmt::format("a sheet of {} transfers for {}", sheet.round.size(), transfers.size())};
  const auto degree = degrees(transfers);
  std::map<std::array<uint32_t, 3>, uint32_t> at_once;
  for (size_t i = 0; i < transfers.size(); ++i) {
    const uint32_t round = sheet.round[i];
    if (round >= sheet.rounds) return Error{fmt::format("transfer {} is in round {} of {}", i, round, sheet.rounds)};
    for (const uint32_t side : {0u, 1u}) {
      const uint32_t node = side == 0 ? transfers[i].sender : transfers[i].receiver;
      const uint32_t most = (degree.at({side, node}) + sheet.rounds - 1) / sheet.rounds;
      if (++at_once[{side, node, round}] > most)
        return Error{fmt::format("{} {} has more than {} transfers in round {}", side == 0 ? "sender" : "receiver",
                                 node, most, round)};
    }
  }
  return ok_status();
}

}  // namespace telesplat::master
