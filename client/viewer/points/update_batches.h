// Holds changes of the point model until a whole view update is there (synchronous and loose coupling), so that the
// display never shows a part of one. Patches are prepared before they come here; the display merges them into the
// model, since it waits for the update anyway.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/points/model_cache.h"
#include "common/wire/wall_messages.h"

namespace telesplat::viewer {

class UpdateBatches {
 public:
  /// Points that are held back at most (updates of other viewers come while our own stays incomplete): beyond this all
  /// changes are applied at once.
  static constexpr uint64_t kMaxPoints = 16u << 20;

  struct Insert {
    points::PreparedPatch patch;
    EpochId epoch;
  };
  struct Forget {
    Sequence sequence;
    std::vector<points::ClusterKey> clusters;
    std::vector<uint32_t> frames;
  };
  struct Refine {
    points::PreparedRefinement refinement;
  };
  struct Begin {
    points::ModelConfig config;
    EpochId epoch;
    Sequence sequence;
  };
  using Change = std::variant<Insert, Forget, Refine, Begin>;

  // ---- worker ----
  /// packer: the one that sent the event.
  void add(Change change, ModelCache& cache, InstanceId packer = {});
  /// The update of this request is complete with what was added so far. It may have to wait for earlier ones.
  void complete(RequestId request);
  /// The update may be displayed from now on. It, or earlier ones, contain all changes up to complete(), or up to now.
  void close(const ShownUpdate& update);
  /// The display waits no more: applies all changes, and shows the newest replica that has a closed update; then it
  /// calls shown(). begun: called for each replica that begins after that; held: an older one stays on display. Returns
  /// the newest closed update; nothing: no update was closed, and shown() is not called.
  std::optional<ShownUpdate> release(ModelCache& cache, const std::function<void()>& shown,
                                     const std::function<void(const Begin&, bool held)>& begun);

  // ---- display thread ----
  /// Applies all changes up to the end of this update and shows the newest replica. Nothing: the update was not closed.
  std::optional<ShownUpdate> apply(RequestId request, ModelCache& cache);
  /// If several viewers show the same (a wall): the state that apply_until() could show by now. It includes a new
  /// replica once an update is closed in it, or after kReplicaPatience_s.
  wire::ShownState newest(double now_s) const;
  static constexpr double kReplicaPatience_s = 1;
  /// Applies the changes up to that state, and shows its replica. Returns the newest update closed in it, if an earlier
  /// call did not return it.
  std::optional<ShownUpdate> apply_until(const wire::ShownState& state, ModelCache& cache);

 private:
  struct Held {
    Change change;
    InstanceId packer;
  };
  bool apply_front(ModelCache& cache);

  mutable std::mutex mutex_;
  std::deque<Held> changes_;
  struct End {
    ShownUpdate update;
    uint64_t change = 0;  // number of the first change after it
  };
  std::deque<End> ends_;
  std::map<RequestId, uint64_t> complete_;  // from complete(): End::change
  uint64_t first_ = 0;                      // number of changes_.front()
  uint64_t points_ = 0;
  wire::ShownState newest_;   // state of the newest change
  uint64_t begun_ = 0;        // ShownState::replica of the newest replica
  double begun_s_ = 0;        // when that began, on this machine
  wire::ShownState applied_;  // its replica is the newest that began
};

}  // namespace telesplat::viewer
