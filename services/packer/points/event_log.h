// The events that late joiners and viewers with gaps still need.
//
// Forgetting a cluster wipes what patches put there before. So a replica comes to the present state by applying, in
// order, every patch that has a point left and, for each cluster, its last forget: earlier forgets of it are covered by
// the last one, and a patch whose every cluster was forgotten later leaves nothing behind. The same holds where single
// patches of clusters are forgotten. There is no end to those forgets, so they are kept for a while only. A patch that
// still has points in another cluster keeps its own.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Patches of clusters named by the forget events that are kept, at most (eight bytes each).
inline constexpr size_t kMaxPatchesForgotten = size_t{1} << 20;

class EventLog {
 public:
  explicit EventLog(size_t max_patches_forgotten = kMaxPatchesForgotten) : max_patches_(max_patches_forgotten) {}

  /// clusters: those in which the patch has points; none: nothing is kept.
  void add_patch(const Event& event, std::span<const points::ClusterKey> clusters);
  /// clusters: those that were there.
  void add_forget(Sequence sequence, std::span<const points::ClusterKey> clusters);
  /// Single patches of clusters were forgotten: each element of `dropped` has mosaics of one frame. event: as
  /// published.
  void add_patch_forget(const Event& event, std::span<const points::Cluster> dropped);
  void add_epoch(const Event& event);
  /// A patch became exact: who gets the patch gets this, too. Precondition: is_whole(event.refines).
  void add_refinement(const Event& event);
  /// True if the patch is kept and nothing of it was forgotten.
  bool is_whole(Sequence patch) const;

  /// False: it is not known any more what a replica as of `after` would have to forget.
  bool remembers(Sequence after) const;
  /// See PackerCore::events_since.
  std::vector<Event> since(Sequence after) const;

  /// The same event by event, while the log goes on: what is forgotten meanwhile is left out, and whoever applies this
  /// is told of that by the events that follow `until`.
  struct Replay {
    Sequence after, until;     ///< of the patches that are still to come
    /// forgets, epochs, refinements and patches that are not in the log, in order
    std::deque<Event> others;
    EpochId epoch;             ///< of all of them
  };
  Replay replay(Sequence after, Sequence until) const;
  /// Nothing: that was all.
  std::optional<Event> next(Replay& replay) const;

  struct Patch {
    Event event;
    size_t alive = 0;                             ///< clusters in which it is not forgotten
    std::vector<points::ClusterKey> forgotten{};  ///< where else it was, if whole clusters were forgotten
    std::vector<std::pair<Sequence, points::ClusterKey>> patch_forgotten{};  ///< if this patch of them was, and when
    Sequence refined;  ///< by which event; 0: it was not
    std::shared_ptr<const std::vector<uint8_t>> refinement{};  ///< its blob
    uint64_t bytes() const;  ///< with its places in patches_of_clusters()
  };
  const std::map<Sequence, Patch>& patches() const { return patches_; }
  /// The patches that brought the points of each cluster that has any.
  const std::unordered_map<points::ClusterKey, std::vector<Sequence>>& patches_of_clusters() const {
    return patches_of_;
  }
  uint64_t patch_bytes() const { return patch_bytes_; }
  uint64_t bytes() const;

 private:
  void drop_part(Sequence patch, points::ClusterKey key, Sequence sequence, bool patch_alone);
  std::vector<Event> forgets(Sequence after, bool from_nothing) const;
  std::vector<Event> patch_forgets(Sequence after, bool from_nothing) const;
  std::vector<Event> refinements(Sequence after) const;

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

/// Which views became complete of late: viewers that missed it wait for it. Where the patch that completed a view
/// brought no points, or they were forgotten since, the event log leaves it out: the model does not need it.
class Completions {
 public:
  static constexpr size_t kMostViews = 8;  ///< of each viewer, the newest; none has more buffers (wire::kMaxBuffers)
  static constexpr size_t kMostViewers = 256;  ///< beyond, the one that waited longest for a view is dropped

  /// An event was published. A new epoch voids what was complete before it.
  void add(const Event& event);
  /// Puts in, in order, what completed views of this viewer after `after` and is not among the events, as patches
  /// without points. events: those after `after`, in order.
  void fill(std::deque<Event>& events, InstanceId viewer, Sequence after) const;
  void clear() { of_.clear(); }

 private:
  std::map<InstanceId, std::deque<Event>> of_;  // none is empty
};

/// The patches least recently used, until the others have at most 90 % of max_bytes; none if all have no more than
/// max_bytes. used_s: when each patch of the log was used last.
std::unordered_set<Sequence> oldest_patches(const std::unordered_map<Sequence, double>& used_s, const EventLog& log,
                                            uint64_t max_bytes);

}  // namespace telesplat::packer
