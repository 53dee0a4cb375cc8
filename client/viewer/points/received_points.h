// Points of a session: a replica of the packer's model, kept up to date by events.
#pragma once

#include <atomic>
#include <mutex>

#include "client/viewer/points/model_cache.h"
#include "client/viewer/points/received_base.h"
#include "client/viewer/points/receiver.h"
#include "client/viewer/points/update_batches.h"
#include "client/viewer/received.h"
#include "common/core/clock.h"
#include "common/geometry/clip.h"

namespace telesplat::viewer {

/// Says when a viewer reports to the packer how much has arrived.
class ReceiptClock {
 public:
  /// True: a report of this newest event, and of all bytes so far, is due, and is taken to be sent.
  bool due(Sequence newest, uint64_t bytes, double now_s);

 private:
  Sequence newest_;  // as in the last report; below: when, and after how many bytes
  double sent_s_ = -1e9;
  uint64_t bytes_ = 0;
};

class ReceivedPoints final : public Received {
 public:
  ReceivedPoints(const ReceivedOptions& options, const ReceivedLinks& links);

  Status follow(const wire::Welcome& session) override;
  std::span<const Feed> feeds() const override;
  void on_connected() override {
    receiver_.start();
    base_.start(monotonic_s());
  }
  void receive(int most) override;
  void tick(double now_s) override;
  void on_complete(RequestId request) override { batches_.complete(request); }
  void on_update(const ShownUpdate& update) override;
  void on_coupling(int buffers) override;
  void report() override;
  wire::ShownState newest_state() const override { return batches_.newest(monotonic_s()); }
  void show_state(const wire::ShownState& state) override;
  void on_retired() override { retired_ = true; }
  void add_status(net::MasterLink::Values& values) const override;
  Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) override;

  // ---- for its source, in the display's thread ----
  ModelCache& cache() { return cache_; }
  FineRays& fine_rays() { return fine_rays_; }
  /// If the display waits: shows this update, which is complete.
  void advance(RequestId request);
  /// The newest update contained in what is on display.
  ShownUpdate shown() const;
  /// Logs what a frame drew.
  void on_seen(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames);
  /// True if the session packs without eliminating redundancy: then each cluster's best patches are drawn (T4.4.3.3).
  bool keeps_redundant() const { return keeps_redundant_; }
  /// The session's present clip. The points on display may be from an epoch before it.
  struct Cut {
    std::shared_ptr<const geometry::Clip> clip = std::make_shared<const geometry::Clip>();
    uint64_t version = 0;  ///< changes with the clip
    EpochId epoch;         ///< first epoch that is cut like this
  };
  Cut cut() const {
    const std::lock_guard lock(mutex_);
    return cut_;
  }

 private:
  void summarise();
  void show(const ShownUpdate& update);
  void send_receipt(double now_s);

  ReceivedLinks links_;
  bool waits_;                   // the display waits for whole updates; used by the worker
  const bool in_step_;           // the display shows what other viewers show, too (a wall)
  EventRecorder* const events_;  // null: there is no record
  ModelCache cache_;
  FineRays fine_rays_;
  UpdateBatches batches_;
  ReceivedBase base_;
  PointReceiver receiver_;
  points::ModelConfig config_;  // valid once the feeds are connected
  AccessLog reported_;          // takes turns with seen_
  /// The last report stays valid while the display waits and draws nothing.
  std::vector<AccessLog::Report> on_display_;
  ReceiptClock receipts_;
  std::atomic<bool> keeps_redundant_{false}, retired_{false};

  mutable std::mutex mutex_;  // guards the members below, which both threads use
  AccessLog seen_;
  ShownUpdate shown_;
  Cut cut_;
};

}  // namespace telesplat::viewer
