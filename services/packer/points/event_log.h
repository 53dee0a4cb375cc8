// The events that late joiners and viewers with gaps still need.
//
// Forgetting a cluster removes the points of all patches before. So a replica reaches the present state by applying, in
// order, every patch that has a point left and, for each cluster, its last forget: the last forget of a cluster covers
// the earlier ones, and a patch whose every cluster was forgotten later leaves no point behind. The same holds where
// single patches of clusters are forgotten. Their forgets would grow without end, so only the newest are kept. A patch
// that still has points in another cluster keeps its own.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Patches of clusters named in the forget events that are kept, at most (eight bytes each).
inline constexpr size_t kMaxPatchesForgotten = size_t{1} << 20;

class EventLog {
 public:
  explicit EventLog(size_t max_patches_forgotten = kMaxPatchesForgotten) : max_patches_(max_patches_forgotten) {}

  /// clusters: those in which the patch has points; empty: the patch is not kept.
  void add_patch(const Event& event, std::span<const points::ClusterKey> clusters);
  /// clusters: those that the model held.
  void add_forget(Sequence sequence, std::span<const points::ClusterKey> clusters);
  /// Single patches of clusters were forgotten: each element of `dropped` has mosaics of one frame. event: the
  /// published event.
  void add_patch_forget(const Event& event, std::span<const points::Cluster> dropped);
  void add_epoch(const Event& event);
  /// A patch became exact: replicas that get the patch get this event, too. Precondition: is_whole(event.refines).
  void add_refinement(const Event& event);
  /// True if the patch is kept and no part of it was forgotten.
  bool is_whole(Sequence patch) const;

  /// False: the log no longer knows all that a replica as of `after` must forget.
  bool remembers(Sequence after) const;
  /// Returns the events of PackerCore::events_since().
  std::vector<Event> since(Sequence after) const;

  /// The same event by event, while the log goes on: patches forgotten meanwhile are left out, and the events after
  /// `until` hold their forgets.
  struct Replay {
    Sequence after, until;  ///< range of the patches that are still to come
    /// forgets, epochs, refinements and patches that are not in the log, in order
    std::deque<Event> others;
    EpochId epoch;  ///< epoch of all these events
  };
  Replay replay(Sequence after, Sequence until) const;
  /// Returns the next event; nullopt after the last.
  std::optional<Event> next(Replay& replay) const;

  struct Patch {
    Event event;
    size_t alive = 0;                             ///< clusters in which it is not forgotten
    std::vector<points::ClusterKey> forgotten{};  ///< whole clusters that were forgotten and held its points
    std::vector<std::pair<Sequence, points::ClusterKey>> patch_forgotten{};  ///< forgets of this patch alone
    Sequence refined;                                                        ///< kRefine event; 0: not refined
    std::shared_ptr<const std::vector<uint8_t>> refinement{};                ///< the kRefine event's blob
    uint64_t bytes() const;  ///< with the patch's entries in patches_of_clusters()
  };
  const std::map<Sequence, Patch>& patches() const { return patches_; }
  /// For each cluster that has points, the patches that brought them.
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
  std::deque<Event> patch_forgets_;  // the newest ones
  size_t patches_forgotten_ = 0;     // number of patches named in patch_forgets_
  Sequence horizon_;                 // sequence of the newest event dropped from patch_forgets_
  std::optional<Event> epoch_;       // the newest epoch event: everything before it is void
  uint64_t patch_bytes_ = 0;
};

/// The views that became complete lately, for viewers that missed it. If the patch that completed a view brought no
/// points, or they were forgotten since, the event log does not hold it: the model does not need it.
class Completions {
 public:
  static constexpr size_t kMostViews = 8;  ///< newest views per viewer; no viewer has more buffers (wire::kMaxBuffers)
  static constexpr size_t kMostViewers = 256;  ///< with one more, the viewer whose newest view is oldest is dropped

  /// An event was published. A new epoch voids earlier completions.
  void add(const Event& event);
  /// Inserts into `events`, which are those after `after`, the completions of this viewer's views that they lack, as
  /// patches without points. All in order.
  void fill(std::deque<Event>& events, InstanceId viewer, Sequence after) const;
  void clear() { of_.clear(); }

 private:
  std::map<InstanceId, std::deque<Event>> of_;  // no deque is empty
};

/// Returns the patches least recently used, until the others have at most 90 % of max_bytes; empty if all have at most
/// max_bytes. used_s: when each patch of the log was used last.
std::unordered_set<Sequence> oldest_patches(const std::unordered_map<Sequence, double>& used_s, const EventLog& log,
                                            uint64_t max_bytes);

}  // namespace telesplat::packer
