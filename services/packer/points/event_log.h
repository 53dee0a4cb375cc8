// The events that late joiners and viewers with gaps still need.
//
// Forgetting a cluster wipes what patches put there before. So a replica comes to the present state by applying, in
// order, every patch that has a point left and, for each cluster, its last forget: earlier forgets of it are covered by
// the last one, and a patch whose every cluster was forgotten later leaves nothing behind. Where single patches of clusters are
// forgotten the same holds for each of those; but there is no end to them, so that forgets of them are kept for a while only, but
// for those of which some other cluster's points are alive: they stay with their event.
#pragma once

#include <deque>
#include <map>
#include <unordered_map>

#include "services/packer/points/packer_core.h"

namespace telesplat::packer {

/// Patches of clusters in the forget events kept, at most (eight bytes each).
inline constexpr size_t kMaxPatchesForgotten = size_t{1} << 20;

class EventLog {
 public:
  explicit EventLog(size_t max_patches_forgotten = kMaxPatchesForgotten) : max_patches_(max_patches_forgotten) {}

  /// clusters: those it has points in; none: nothing to keep.
  void add_patch(const Event& event, std::span<const points::ClusterKey> clusters);
  /// clusters: those that were there.
  void add_forget(Sequence sequence, std::span<const points::ClusterKey> clusters);
  /// The same of single patches: each element of `dropped` has mosaics of one frame. event: as it is published.
  void add_patch_forget(const Event& event, std::span<const points::Cluster> dropped);
  void add_epoch(const Event& event);

  /// False for a replica of which it is not known any more what it would have to forget.
  bool remembers(Sequence after) const;
  /// See PackerCore::events_since.
  std::vector<Event> since(Sequence after) const;

  struct Patch {
    Event event;
    size_t alive = 0;                             ///< clusters in which it is not forgotten
    std::vector<points::ClusterKey> forgotten{};  ///< where else it was, if whole clusters were forgotten
    std::vector<std::pair<Sequence, points::ClusterKey>> patch_forgotten{};  ///< if this patch of them was, and when
    uint64_t bytes() const;  ///< with its places in patches_of_clusters()
  };
  const std::map<Sequence, Patch>& patches() const { return patches_; }
  /// Of each cluster that has points, the patches that brought them.
  const std::unordered_map<points::ClusterKey, std::vector<Sequence>>& patches_of_clusters() const {
    return patches_of_;
  }
  uint64_t patch_bytes() const { return patch_bytes_; }
  uint64_t bytes() const;

 private:
  void drop_part(Sequence patch, points::ClusterKey key, Sequence sequence, bool patch_alone);
  std::vector<Event> forgets(Sequence after, bool from_nothing) const;
  std::vector<Event> patch_forgets(Sequence after, bool from_nothing) const;

  const size_t max_patches_;
  std::map<Sequence, Patch> patches_;
  std::unordered_map<points::ClusterKey, std::vector<Sequence>> patches_of_;
  std::unordered_map<points::ClusterKey, Sequence> last_forget_;
  std::deque<Event> patch_forgets_;  // newest ones
  size_t patches_forgotten_ = 0;     // in them
  Sequence horizon_;                 // of the newest that was dropped from them
  std::optional<Event> epoch_;       // the newest one: everything before it is void
  uint64_t patch_bytes_ = 0;
};

}  // namespace telesplat::packer
