// Changes of the point model that wait until a whole view update is there (synchronous and loose coupling): what is on
// display never shows a part of one. Patches are prepared before they come here; merging them into the model is left to
// the display, which waits for the update anyway.
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
  /// Points that are held back at most (other viewers' updates while none of one's own becomes complete): beyond,
  /// everything is applied at once.
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
  /// packer: whose event it is.
  void add(Change change, ModelCache& cache, InstanceId packer = {});
  /// The update of this request is complete with what was added so far. It may have to wait for earlier ones.
  void complete(RequestId request);
  /// It may be displayed from now on: to it, or to earlier ones, belongs what was added until it was complete, or so
  /// far.
  void close(const ShownUpdate& update);
  /// The display waits for nothing any more: applies everything and shows the newest replica that a closed update is
  /// of; then it calls shown(). begun: told of each replica that begins after that, and whether an older one stays on
  /// display. Returns the newest closed update; none: nothing was closed, and shown() is not called.
  std::optional<ShownUpdate> release(ModelCache& cache, const std::function<void()>& shown,
                                     const std::function<void(const Begin&, bool held)>& begun);

  // ---- display thread ----
  /// Applies all changes up to the end of this update and shows the newest replica. Nothing: it was not closed.
  std::optional<ShownUpdate> apply(RequestId request, ModelCache& cache);
  /// Where several viewers show the same (a wall): what apply_until() could show by now. A replica that began is among
  /// it once an update is closed in it, or kReplicaPatience_s later.
  wire::ShownState newest(double now_s) const;
  static constexpr double kReplicaPatience_s = 1;
  /// Applies the changes up to that state, and shows its replica. Returns the newest update that is closed in it, if
  /// that is not the one of an earlier call.
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
    uint64_t change = 0;  // number of the first that does not belong to it
  };
  std::deque<End> ends_;
  std::map<RequestId, uint64_t> complete_;  // complete(): End::change
  uint64_t first_ = 0;                      // number of changes_.front()
  uint64_t points_ = 0;
  wire::ShownState newest_;   // of the newest change
  uint64_t begun_ = 0;        // ShownState::replica of the newest
  double begun_s_ = 0;        // when it did, here
  wire::ShownState applied_;  // its replica: the newest that began
};

}  // namespace telesplat::viewer
