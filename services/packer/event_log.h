// The events that late joiners and viewers with gaps still need.
//
// Forgetting a cluster wipes what patches put there before. So a replica comes to the present state by applying, in
// order, every patch that has a point left and, for each cluster, its last forget: earlier forgets of it are covered by
// the last one, and a patch whose every cluster was forgotten later leaves nothing behind.
#pragma once

#include <map>
#include <unordered_map>

#include "services/packer/packer_core.h"

namespace telesplat::packer {

class EventLog {
 public:
  /// mosaics: how many clusters it has points in; none: nothing to keep.
  void add_patch(const Event& event, size_t mosaics);
  /// dropped: what the model handed out.
  void add_forget(Sequence sequence, std::span<const points::Cluster> dropped);
  void add_epoch(const Event& event);

  /// See PackerCore::events_since.
  std::vector<Event> since(Sequence after) const;

  struct Patch {
    Event event;
    size_t alive = 0;                             ///< mosaics not forgotten
    std::vector<points::ClusterKey> forgotten{};  ///< where its other mosaics were
    uint64_t bytes() const;
  };
  const std::map<Sequence, Patch>& patches() const { return patches_; }
  uint64_t patch_bytes() const { return patch_bytes_; }
  uint64_t bytes() const;

 private:
  std::vector<Event> forgets(Sequence after, bool from_nothing) const;

  std::map<Sequence, Patch> patches_;
  std::unordered_map<points::ClusterKey, Sequence> last_forget_;
  std::optional<Event> epoch_;  // the newest one: everything before it is void
  uint64_t patch_bytes_ = 0;
};

}  // namespace telesplat::packer
