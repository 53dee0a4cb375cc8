// Which chunks a sampler holds, which it waits for, which it lets go: the least recently used ones first when over its
// budget. No sockets, no clocks.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/mesh_chunk.h"

namespace telesplat::sampler {

class ChunkCache {
 public:
  explicit ChunkCache(uint64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// The data set's chunks; forgets everything held before.
  void reset(std::vector<geometry::ChunkInfo> chunks);
  bool known() const { return !chunks_.empty(); }

  /// Chunks the view needs and that are not held, nearest first; marks the held ones as used. Waiting ones are
  /// included.
  std::vector<ChunkId> missing(const geometry::Camera& camera);
  /// Chunks worth fetching before any view asks, as far as the budget goes: in order of id.
  std::vector<ChunkId> prefetch() const;

  bool held(ChunkId id) const { return held_.contains(id); }
  bool waiting(ChunkId id) const { return waiting_.contains(id); }
  size_t waiting_count() const { return waiting_.size(); }
  void mark_waiting(ChunkId id) { waiting_.insert(id); }
  void forget_waiting() { waiting_.clear(); }
  /// As the list says.
  uint64_t bytes_of(ChunkId id) const;
  uint64_t waiting_bytes() const;
  /// Takes note of a chunk of this size that came. Returns those to remove to stay within the budget; never one the
  /// last view needs.
  std::vector<ChunkId> insert(ChunkId id, uint64_t bytes);
  /// What came is no chunk. It is missing still, until it was refused kTries times: then views do without it. Returns
  /// whether it was the last time.
  static constexpr int kTries = 3;
  bool refuse(ChunkId id);
  /// Those that views do without.
  size_t holes() const { return holes_; }

  uint64_t bytes() const { return bytes_; }
  const std::vector<geometry::ChunkInfo>& chunks() const { return chunks_; }

 private:
  uint64_t budget_bytes_;
  std::vector<geometry::ChunkInfo> chunks_;  // index = id
  struct Held {
    uint64_t use;  // the last
    uint64_t bytes;
  };
  std::map<ChunkId, Held> held_;  // holes, too: nothing
  std::map<ChunkId, int> refused_;
  std::set<ChunkId> waiting_;
  size_t holes_ = 0;
  uint64_t use_ = 0, bytes_ = 0;
};

}  // namespace telesplat::sampler
