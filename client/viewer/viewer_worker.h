// The viewer's network side, on a thread of its own: receives updates (point-model events, frames of volumes), decodes them and puts them into the
// caches, asks for views, reports what was drawn, measures updates. It never holds up a display frame.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "client/viewer/coupling/coupling_gate.h"
#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/points/access_log.h"
#include "client/viewer/points/receiver.h"
#include "client/viewer/slices/receiver.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "common/net/service.h"

namespace telesplat::viewer {

/// What a session shows; unknown until the master told it.
enum class SceneKind { kUnknown, kPoints, kVolume };

/// What the worker fills and the display draws.
struct ViewerCaches {
  ModelCache points;
  UpdateBatches batches;  ///< of points, where the display waits for whole updates
  SliceCache slices;
  CouplingGate gate;
  /// buffers: as buffers_of(); 0: asynchronous.
  explicit ViewerCaches(int buffers) : slices(buffers > 0), gate(buffers) {}
};

class ReplicaWorker {
 public:
  struct Options {
    net::ServiceOptions service;
    RequestOptions requests;                   ///< buffers are the gate's
    std::map<std::string, std::string> facts;  ///< for the hello
    double epoch_patience_s = 0.15;            ///< EpochSwitch
    EventRecorder* events = nullptr;  ///< keeps every applied event; null: nothing is kept. Outlives the worker
    double started_s = 0;             ///< when the session was started, on the monotonic clock; 0: now
  };

  /// Starts the thread.
  ReplicaWorker(net::Context& context, const Options& options, ViewerCaches& caches, metrics::TableRecorder& frames,
                metrics::SpanRecorder& spans);
  /// Stops it, after a last flush of metrics and a goodbye.
  ~ReplicaWorker();

  // ---- display thread ----
  /// The head is here; nothing is displayed yet.
  void on_pose(double now_s, const geometry::Camera& camera);
  /// Something of the scene was displayed for the first time (later calls change nothing).
  void on_first_points(double now_s);
  /// A frame of this epoch was displayed with this camera. waited_for: the update that it waited for, if it did.
  void on_frame(double now_s, const geometry::Camera& camera, EpochId epoch, const ShownUpdate* waited_for);
  /// What a frame drew of the point model.
  void on_seen(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames);
  SceneKind kind() const { return kind_; }
  /// True once one view update is complete.
  bool first_update_complete() const { return updates_ > 0; }
  bool shutdown_requested() const { return shutdown_; }
  double to_master_s(double local_s) const { return local_s + offset_s_; }

  /// The newest that is complete and, without coupling, in the cache.
  ShownUpdate last_update() const;

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
  void connect(const std::string& patches, const std::string& state);
  void receive_control();
  void on_part(const ViewPart& part);
  void release(const std::vector<RequestId>& requests);
  void on_epoch();
  void send_access_reports();
  void request_views(double now_s);
  void report(double now_s, bool last);
  net::MasterLink::Values status() const;

  net::Context& context_;
  Options options_;
  ViewerCaches& caches_;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  metrics::TableRecorder updates_table_;
  net::MasterLink link_;
  std::optional<net::Socket> patches_, state_;
  std::string patches_endpoint_, state_endpoint_;
  PointReceiver points_;
  SliceReceiver slices_;
  ViewRequester requester_;
  std::map<RequestId, ShownUpdate> complete_;  // where the display waits: those that wait for earlier ones
  AccessLog reported_;                         // takes turns with seen_
  int seen_version_ = 0;
  InstanceId master_;
  bool other_master_ = false;
  double started_s_ = 0, last_report_s_ = 0;

  struct SeenPose {
    double t_s = 0;
    geometry::Camera camera;
    double waited_since_s =
        0;  // master's clock: when the update was requested that the frame waited for; 0: it did not
  };
  mutable std::mutex mutex_;  // guards what display thread and worker exchange, below
  std::vector<SeenPose> poses_;
  AccessLog seen_;
  ShownUpdate last_update_;
  std::string scene_;
  double extent_m_ = 0, latency_ms_ = 0;

  std::atomic<SceneKind> kind_{SceneKind::kUnknown};
  std::atomic<uint64_t> updates_{0}, frames_shown_{0}, bytes_received_{0}, epochs_shown_{0}, epoch_shown_{0};
  std::atomic<bool> shutdown_{false}, stop_{false}, keeps_redundant_{false};
  std::atomic<double> offset_s_{0}, first_points_s_{0};
  std::thread thread_;
};

}  // namespace telesplat::viewer
