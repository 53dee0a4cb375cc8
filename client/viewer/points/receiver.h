// The worker's part for scenes of points: puts model events in order, decodes and prepares them, and applies them to
// the cache: at once, or, if the display waits for whole updates, when the display takes them.
#pragma once

#include <functional>

#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/points/epoch_switch.h"
#include "client/viewer/points/event_sequencer.h"
#include "client/viewer/points/model_cache.h"
#include "client/viewer/points/received_base.h"
#include "client/viewer/points/replica_check.h"
#include "client/viewer/points/update_batches.h"
#include "client/viewer/record/event_record.h"
#include "client/viewer/render/fine_rays.h"
#include "common/core/log.h"
#include "common/image/depth_image.h"
#include "common/metrics/recorder.h"
#include "common/net/socket.h"
#include "common/refinement/bounded_patches.h"

namespace telesplat::viewer {

class PointReceiver {
 public:
  struct Options {
    InstanceId viewer;
    double epoch_patience_s = 0.15;   ///< EpochSwitch
    EventRecorder* events = nullptr;  ///< keeps every applied event; null: there is no record
    bool hold = false;                ///< changes go to the batches, not to the cache
  };
  struct Links {
    std::function<points::ModelConfig()> config;  ///< for a replica that begins
    std::function<void(const wire::StateRequest&)> request_state;
    ReceivedBase* base = nullptr;                  ///< takes messages about the base
    std::function<void(const ViewPart&)> on_part;  ///< a patch was applied, or put into the batches
    std::function<void()> on_epoch;                ///< a new epoch began
    std::function<double(double)> to_master_s;
  };
  PointReceiver(const Options& options, Links links, ModelCache& cache, FineRays& rays, UpdateBatches& batches,
                metrics::SpanRecorder& spans);

  /// Changes go to the batches from now on, until release().
  void hold() { options_.hold = true; }
  /// Applies the held changes; later changes go to the cache at once. Returns the newest complete update among them, if
  /// there is one.
  std::optional<ShownUpdate> release();
  /// The packer is at another address.
  void start() { sequencer_.start(); }
  /// True after start(): there may be a replica.
  bool begun() const { return sequencer_.begun(); }
  void receive_events(net::Socket& patches, int most);
  void receive_answers(net::Socket& state, int most);
  /// Drops the base: it is another scene's.
  void drop_base();
  /// Does what is due by time alone. To be called every few milliseconds.
  void tick(double now_s);

  struct Figures {
    uint64_t points_received = 0, decode_errors = 0, gaps = 0, epochs_shown = 0;
    EpochId epoch;  ///< on display; valid only if no changes are held
    Sequence sequence;
    InstanceId packer;            ///< packer that numbered `sequence`
    uint64_t bytes_received = 0;  ///< images of patches and refinements
    uint64_t patches_refined = 0;
    uint64_t digests_equal = 0, digests_different = 0;  ///< ReplicaCheck
  };
  Figures figures() const;

 private:
  void apply(const ModelEvent& event);
  template <class M>
  void apply_base(const M& message);
  void on_published_mark(const wire::StateMark& mark);
  void record(const ModelEvent& event);
  /// False if the patch cannot be decoded.
  bool apply_patch(const wire::Patch& patch, double arrived_s);
  bool apply_refinement(const wire::Refine& refine);
  void begin_replica(const points::ModelConfig& config, EpochId epoch, Sequence sequence);

  Options options_;
  Links links_;
  ModelCache& cache_;
  FineRays& rays_;  // for the viewer's own views
  UpdateBatches& batches_;
  metrics::SpanRecorder& spans_;
  EventSequencer sequencer_;
  EpochSwitch switch_;
  ReplicaCheck check_;
  points::ModelConfig config_;  // the newest replica's, which may be held, and its epoch; 0: not known yet
  EpochId epoch_;
  image::DepthImage tile_;  // decoding reuses its memory
  refinement::BoundedPatches bounded_;
  log::RateLimiter told_of_patches_;  // limits warnings about patches that cannot be decoded
  double asked_s_ = 0;
  uint64_t points_received_ = 0, bytes_received_ = 0, decode_errors_ = 0, epochs_shown_ = 0, patches_refined_ = 0;
};

}  // namespace telesplat::viewer
