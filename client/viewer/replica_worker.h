// The viewer's network side, on a thread of its own: receives point-model events, decodes and applies them to the cache, asks for
// views, reports what was drawn, measures updates. It never holds up a display frame.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

#include "client/viewer/cache/epoch_switch.h"
#include "client/viewer/cache/event_sequencer.h"
#include "client/viewer/cache/model_cache.h"
#include "client/viewer/coupling/access_log.h"
#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/record/event_record.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "common/net/service.h"

namespace telesplat::viewer {

class ReplicaWorker {
 public:
  struct Options {
    net::ServiceOptions service;
    RequestOptions requests;
    std::map<std::string, std::string> facts;  ///< for the hello
    double epoch_patience_s = 0.15;            ///< EpochSwitch
    EventRecorder* events = nullptr;  ///< keeps every applied event; null: nothing is kept. Outlives the worker
    double started_s = 0;             ///< when the session was started, on the monotonic clock; 0: now
  };

  /// Starts the thread.
  ReplicaWorker(net::Context& context, const Options& options, ModelCache& cache, metrics::TableRecorder& frames,
                metrics::SpanRecorder& spans);
  /// Stops it, after a last flush of metrics and a goodbye.
  ~ReplicaWorker();

  // ---- display thread ----
  /// The head is here; nothing is displayed yet.
  void on_pose(double now_s, const geometry::Camera& camera);
  /// Points were displayed for the first time (later calls change nothing).
  void on_first_points(double now_s);
  /// A frame was displayed with this camera; `list`: what it drew.
  void on_frame(double now_s, const geometry::Camera& camera, const splat::DrawList& list);
  /// Events applied so far tell a first update: true once one frame was applied completely.
  bool first_update_complete() const { return updates_ > 0; }
  bool shutdown_requested() const { return shutdown_; }
  double to_master_s(double local_s) const { return local_s + offset_s_; }

  struct LastUpdate {
    double requested_s = 0;
    geometry::Pose pose;
    uint64_t sequence = 0;
  };
  LastUpdate last_update() const;

  /// For people who watch.
  struct Figures {
    std::string scene;    ///< name of the data set; empty until the master told it
    double extent_m = 0;  ///< its largest extent in the room; 0 until then
    uint64_t updates = 0, bytes_received = 0;
    double latency_ms = 0;      ///< of the newest update; 0 before the first
    uint64_t epochs_shown = 0;  ///< times a new epoch took the place of one on display
  };
  Figures figures() const;
  /// The session packs without eliminating redundancy: of each cluster the best patches are to be drawn (T4.4.3.3).
  bool keeps_redundant() const { return keeps_redundant_; }

 private:
  void loop();
  void connect_if_changed();
  void receive_control();
  void receive_events();
  void receive_answers();
  void apply(const ModelEvent& event);
  /// False if it cannot be decoded.
  bool apply_patch(const wire::Patch& patch);
  void begin_replica(const points::ModelConfig& config, EpochId epoch, Sequence sequence);
  void show_if_due();
  void send_access_reports();
  void request_view(double now_s);
  void report(double now_s, bool last);
  net::MasterLink::Values status() const;

  net::Context& context_;
  Options options_;
  ModelCache& cache_;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  metrics::TableRecorder updates_table_;
  net::MasterLink link_;
  std::optional<net::Socket> patches_, state_;
  std::string patches_endpoint_, state_endpoint_;
  EventSequencer sequencer_;
  EpochSwitch switch_;
  ViewRequester requester_;
  AccessLog reported_;      // takes turns with seen_
  image::DepthImage tile_;  // memory that decoding reuses
  int seen_version_ = 0;
  double started_s_ = 0, last_report_s_ = 0, asked_s_ = 0;
  uint64_t points_received_ = 0, decode_errors_ = 0;

  mutable std::mutex mutex_;  // guards what display thread and worker exchange, below
  std::vector<std::pair<double, geometry::Camera>> poses_;
  AccessLog seen_;
  LastUpdate last_update_;
  std::string scene_;
  double extent_m_ = 0, latency_ms_ = 0;

  std::atomic<uint64_t> updates_{0}, frames_shown_{0}, bytes_received_{0}, epochs_shown_{0};
  std::atomic<bool> shutdown_{false}, stop_{false}, keeps_redundant_{false};
  std::atomic<double> offset_s_{0}, first_points_s_{0};
  std::thread thread_;
};

}  // namespace telesplat::viewer
