// The viewer's network side, on a thread of its own: keeps the link to the master, receives updates, asks for views,
// measures updates, reports what was drawn. What it receives is a Received's business; the worker does not know of what
// kind the scene is. It never holds up a display frame.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/stage_table.h"
#include "client/viewer/display/frame_table.h"
#include "client/viewer/hands/errands.h"
#include "client/viewer/hands/meaning.h"
#include "client/viewer/input/pose_feed.h"
#include "client/viewer/legend_book.h"
#include "client/viewer/received.h"
#include "client/viewer/record/recent_values.h"
#include "client/viewer/session_record.h"
#include "client/viewer/succession.h"
#include "common/net/service.h"
#include "common/net/turns.h"
#include "common/scene/session.h"

namespace telesplat::viewer {

class ViewerWorker : public net::Turns {
 public:
  struct Options {
    net::ServiceOptions service;
    RequestOptions requests;  ///< buffers are the gate's, as it begins
    /// RequestOptions::min_scale. Nothing: the session's setting least_sampling.
    std::optional<double> least_sampling;
    std::map<std::string, std::string> facts;  ///< for the hello
    ReceivedOptions received;                  ///< its recorders are the record's
    SessionRecord* record = nullptr;           ///< null: nothing is kept. Outlives the worker
    std::shared_ptr<const PoseFeed> poses;     ///< moves the head; null: nobody does. Its figures are reported
    std::shared_ptr<const RendererChoice> renderer = std::make_shared<RendererChoice>();  ///< of the display
    bool own_thread = true;  ///< false: its owner takes its turns
    double started_s = 0;    ///< when the session was started, on the monotonic clock; 0: now
  };

  /// Starts the thread, unless its owner takes the turns.
  ViewerWorker(net::Context& context, const Options& options, CouplingGate& gate, metrics::TableRecorder& frames,
               metrics::SpanRecorder& spans);
  /// Stops the thread, after a last flush of metrics and a goodbye.
  ~ViewerWorker() override;

  // ---- worker thread ----
  std::optional<net::Wait> turn() override;

  // ---- any thread ----
  /// The next turn is the last one.
  void stop() { stop_ = true; }

  // ---- display thread ----
  /// The head is here; nothing is displayed yet.
  void on_pose(double now_s, const geometry::Camera& camera);
  /// Who tracks the head expects it here at t_s, which lies ahead (monotonic clock). Goes with the next pose or frame.
  void on_expected(double t_s, const geometry::Pose& pose);
  /// The next pose or frame is told in another space: how the head moved before means nothing.
  void on_jump();
  /// How far ahead views are asked for, seconds.
  double horizon_s() const { return horizon_s_; }
  /// Something of the scene was displayed for the first time (later calls change nothing).
  void on_first_points(double now_s);
  /// A frame of this epoch was displayed with this camera. shown: the newest update in it; waited: it waited for that.
  void on_frame(double now_s, const geometry::Camera& camera, EpochId epoch, const ShownUpdate& shown, bool waited);
  /// Of a wall: ViewRequester::on_ask().
  void on_ask(uint64_t ask, const geometry::Camera& camera);
  /// The row that the frame has in frames.csv.
  void on_measured(const MeasuredFrame& frame);
  /// The display has waited so long for a view update, in seconds; 0: it waits no longer, or not for long.
  void on_waiting(double waits_s) { waits_s_ = waits_s; }
  /// What to draw from, see Succession::at. Null: it is not known yet what the session shows.
  std::shared_ptr<Received> received_at(RequestId request) { return succession_.at(request); }
  /// True once one view update is complete.
  bool first_update_complete() const { return updates_ > 0; }
  bool shutdown_requested() const { return shutdown_; }
  /// Once that is true: what the master says why, for people; empty: nothing.
  const std::string& shutdown_reason() const { return why_; }
  /// Its thread ended by an exception, which was logged: nothing comes any more.
  bool failed() const { return failed_; }
  /// MasterLink::exit_code().
  int link_code() const { return link_code_; }
  /// It may become another one.
  InstanceId instance() const { return instance_; }
  double to_master_s(double local_s) const { return local_s + offset_s_; }

  /// For people who watch: what the network has of them.
  FrameFigures figures() const;
  /// The session as its master told it last; null before that.
  std::shared_ptr<const wire::Welcome> session() const;
  /// Views are sampled like this from now on.
  void set_sampling(const SamplingWish& wish);
  /// What there is to show; an empty box until that is known.
  ShownScene shown_scene() const;
  /// What others ask of this viewer, for the display to carry out.
  OrderDesk& orders() { return orders_; }
  /// What the session's data are told in; null until the master told it.
  std::shared_ptr<const SceneTerms> terms() const;
  /// Of the frames of this epoch; null: there is nothing to tell.
  std::shared_ptr<const image::Legend> legend_at(EpochId epoch) const { return legends_.at(epoch); }

 private:
  static constexpr double kRecent_s = 5;  // what status reports tell of

  void loop();
  void receive();
  void renew(InstanceId instance);
  void follow_session();
  void follow_record(const wire::Welcome& session);
  void follow_coupling(const wire::SessionSettings& session);
  void follow_pictures(const scene::SessionView& session);
  void follow_depth(const metrics::StagesMs& stages, uint64_t ahead);
  void change_coupling(double now_s);
  Status follow(scene::Pipeline pipeline, const wire::Welcome& session);
  void retire();
  void receive_control();
  void on_part(const ViewPart& part);
  void may_display(const ShownUpdate& update);
  void release(const std::vector<RequestId>& requests);
  void take_poses();
  void take_sampling();
  void ask_again(double now_s);
  void request_views(double now_s);
  void tell_if_coarser(const geometry::Camera& camera);
  void report(double now_s, bool last);
  ReceivedLinks links();
  net::MasterLink::Values status() const;
  void add_recent(net::MasterLink::Values& values) const;
  void add_prediction(net::MasterLink::Values& values) const;

  Options options_;
  CouplingGate& gate_;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  metrics::TableRecorder updates_table_;
  StageTable stages_table_;
  net::MasterLink link_;
  Feeds feeds_;
  ViewRequester requester_;
  std::optional<scene::Pipeline> pipeline_;
  std::shared_ptr<Received> received_;  // the newest of the succession
  Succession succession_;
  std::map<RequestId, ShownUpdate> complete_;  // where the display waits: those that wait for earlier ones
  int seen_version_ = 0;
  bool told_coarser_ = false;
  InstanceId master_;
  bool all_again_ = false;       // what is open is to be asked for again
  std::vector<RequestId> lost_;  // of these, which may be open
  double started_s_ = 0, last_report_s_ = 0;
  PipelineDepth depth_;  // where views come as pictures
  EpochId session_epoch_;
  std::optional<CouplingState> wished_;  // for the time being another one is in force
  double wished_since_s_ = 0;

  struct SeenPose {
    double t_s = 0;
    geometry::Camera camera;
    /// Master's clock: when the update was requested that the frame waited for; 0: it did not.
    double waited_since_s = 0;
    RequestId shown;  ///< the newest update in what was displayed; 0: nothing was
    std::optional<tracking::PosePredictor::Sample> expected{};
    bool jumped = false;
  };
  LegendBook legends_;
  OrderDesk orders_;
  mutable std::mutex mutex_;  // guards what display thread and worker exchange, below
  std::vector<SeenPose> poses_;
  std::optional<tracking::PosePredictor::Sample> expected_;   // of the next one
  bool jumped_ = false;                                       // before the next one
  std::optional<std::pair<uint64_t, geometry::Camera>> ask_;  // the newest of on_ask(), that is not taken yet
  std::string scene_;
  ShownScene shown_scene_;
  std::shared_ptr<const SceneTerms> terms_;
  double latency_ms_ = 0;
  std::shared_ptr<const wire::Welcome> session_;
  std::optional<SamplingWish> sampling_;  // that is not in force yet
  int sampled_width_ = 0, sampled_height_ = 0;

  std::atomic<uint64_t> updates_{0}, frames_shown_{0}, bytes_received_{0}, epochs_shown_{0}, epoch_shown_{0};
  std::string why_;  // written before shutdown_
  std::atomic<bool> shutdown_{false}, failed_{false}, stop_{false};
  std::atomic<int> link_code_{0};
  std::atomic<InstanceId> instance_;
  std::atomic<double> offset_s_{0}, first_points_s_{0}, waits_s_{0}, horizon_s_{0};
  std::atomic<double> longest_gap_ms_{0};  // between two displayed frames
  RecentValues inter_frame_ms_{kRecent_s}, update_age_ms_{kRecent_s}, latencies_ms_{kRecent_s};
  std::thread thread_;
};

}  // namespace telesplat::viewer
