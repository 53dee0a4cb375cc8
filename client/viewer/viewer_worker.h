// The viewer's network side, on a thread of its own: keeps the link to the master, receives updates, asks for views,
// measures updates, reports what was drawn. A Received handles the content; the worker does not know what kind of scene
// it is. It never holds up a display frame.
#pragma once

#include <map>
#include <thread>

#include "client/viewer/hands/errands.h"
#include "client/viewer/input/pose_feed.h"
#include "client/viewer/received.h"
#include "client/viewer/session_record.h"
#include "client/viewer/succession.h"
#include "client/viewer/worker/coupling_follower.h"
#include "client/viewer/worker/display_news.h"
#include "client/viewer/worker/open_updates.h"
#include "client/viewer/worker/session_board.h"
#include "client/viewer/worker/viewer_meter.h"
#include "client/viewer/worker/viewer_tables.h"
#include "common/net/service.h"
#include "common/net/turns.h"
#include "common/scene/session.h"

namespace telesplat::viewer {

class ViewerWorker : public net::Turns {
 public:
  struct Options {
    net::ServiceOptions service;
    RequestOptions requests;  ///< requests.buffers: the gate's buffers at the start
    /// RequestOptions::min_scale. Nothing: the session's setting least_sampling.
    std::optional<double> least_sampling;
    std::map<std::string, std::string> facts;  ///< for the hello
    ReceivedOptions received;                  ///< its recorders are those of `record`
    SessionRecord* record = nullptr;           ///< null: there is no record. Outlives the worker
    std::shared_ptr<const PoseFeed> poses;     ///< moves the head; null: there is no feed. Its figures are reported
    std::shared_ptr<const RendererChoice> renderer = std::make_shared<RendererChoice>();  ///< the display's renderer
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
  void stop() { end_.stop(); }

  // ---- display thread ----
  /// The head is here; nothing is displayed yet.
  void on_pose(double now_s, const geometry::Camera& camera);
  /// The head's tracker expects it here at t_s, which lies ahead (monotonic clock). Goes with the next pose or frame.
  void on_expected(double t_s, const geometry::Pose& pose) { news_.on_expected(t_s, pose); }
  /// The next pose or frame is in another space: earlier movements of the head mean nothing.
  void on_jump() { news_.on_jump(); }
  /// Time ahead for which views are asked for, seconds.
  double horizon_s() const { return board_.horizon_s; }
  /// Something of the scene was displayed for the first time (later calls change nothing).
  void on_first_points(double now_s) { meter_.on_first_points(now_s); }
  /// A frame of this epoch was displayed with this camera. shown: the newest update in it; waited: it waited for that.
  void on_frame(double now_s, const geometry::Camera& camera, EpochId epoch, const ShownUpdate& shown, bool waited);
  /// A wall's viewers ask for views together: ViewRequester::on_ask().
  void on_ask(uint64_t ask, const geometry::Camera& camera) { news_.on_ask({ask, camera}); }
  /// The row that the frame has in frames.csv.
  void on_measured(const MeasuredFrame& frame) { meter_.measured(frame); }
  /// The display has waited this long for a view update, seconds; 0: it does not wait, or not for long.
  void on_waiting(double waits_s) { meter_.waits(waits_s); }
  /// Content to draw: Succession::at(). Null: it is not known yet what the session shows.
  std::shared_ptr<Received> received_at(RequestId request) { return succession_.at(request); }
  /// True once one view update is complete.
  bool first_update_complete() const { return meter_.updates() > 0; }
  bool shutdown_requested() const { return end_.shutdown(); }
  /// The master's reason, for people; empty: it gave none. Precondition: shutdown_requested().
  const std::string& shutdown_reason() const { return end_.why(); }
  /// Its thread ended by an exception, which was logged: nothing comes any more.
  bool failed() const { return end_.failed(); }
  /// MasterLink::exit_code().
  int link_code() const { return end_.link_code(); }
  /// It may become another one.
  InstanceId instance() const { return board_.instance; }
  double to_master_s(double local_s) const { return local_s + board_.offset_s; }

  SessionFigures figures() const;
  /// The session as its master told it last; null before that.
  std::shared_ptr<const wire::Welcome> session() const { return board_.session(); }
  /// Views are sampled like this from now on.
  void set_sampling(const SamplingWish& wish) { news_.on_wish(wish); }
  /// Scene to show; its box is empty until the scene is known.
  ShownScene shown_scene() const { return board_.scene().shown; }
  /// Orders of other processes, for the display to carry out.
  OrderDesk& orders() { return orders_; }
  /// Units and names of the session's data; null until the master sent them.
  std::shared_ptr<const SceneTerms> terms() const { return board_.scene().terms; }
  /// Null: frames of this epoch have no legend.
  std::shared_ptr<const image::Legend> legend_at(EpochId epoch) const { return board_.legends.at(epoch); }

 private:
  void loop();
  void receive();
  void renew(InstanceId instance);
  void follow_session();
  void follow_record(const wire::Welcome& session);
  void follow_pictures(const scene::SessionView& session);
  void change_coupling(double now_s);
  void set_coupling(const CouplingState& state);
  Status follow(scene::Pipeline pipeline, const wire::Welcome& session);
  void retire();
  void receive_control();
  void on_part(const ViewPart& part);
  void may_display(const ShownUpdate& update);
  void release(const std::vector<RequestId>& requests);
  void take_news();
  void take_sampling();
  void ask_again(double now_s);
  void request_views(double now_s);
  void tell_if_coarser(const geometry::Camera& camera);
  void report(double now_s, bool last);
  ReceivedLinks links();
  net::MasterLink::Values status() const;
  void add_prediction(net::MasterLink::Values& values) const;

  /// The session as it was followed last.
  struct Followed {
    int version = 0;
    InstanceId master;
    EpochId epoch;
  };

  Options options_;
  CouplingFollower coupling_;
  ViewerTables tables_;
  net::MasterLink link_;
  Feeds feeds_;
  ViewRequester requester_;
  std::optional<scene::Pipeline> pipeline_;
  std::shared_ptr<Received> received_;  // the newest of the succession
  Succession succession_;
  OpenUpdates open_;
  Followed followed_;
  bool told_coarser_ = false;
  OrderDesk orders_;
  DisplayNews news_;
  SessionBoard board_;
  ViewerMeter meter_;
  SessionEnd end_;
  std::thread thread_;
};

}  // namespace telesplat::viewer
