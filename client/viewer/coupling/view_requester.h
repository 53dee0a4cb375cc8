// Decides which view to ask for next, and when (T6.3-6.5), from past poses and from the coupling of display and server.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/request_options.h"
#include "client/viewer/coupling/sampling_scale.h"
#include "client/viewer/tracking/head_forecast.h"
#include "common/geometry/camera.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Returns the size to sample for a display of width x height pixels: that of the options, or as many pixels in the
/// display's aspect; sides are multiples of 8 and at least 16.
std::pair<int, int> sampling_size(const RequestOptions& options, int width, int height);

/// A part of an answer: a tile of points, or a whole volume frame.
struct ViewPart {
  InstanceId viewer;
  RequestId request;
  EpochId epoch;
  FrameId frame;
  bool complete = false;  ///< the last part of the frame of full resolution
  bool extra = false;     ///< from rays beyond the view's: it belongs to no update
  uint64_t tiles = 1, points = 0, samples = 0, bytes = 0;
  geometry::Camera camera;  ///< the sampled camera
  uint64_t eliminated = 0;  ///< samples that gave no points, because the model has them already
  uint64_t tile = 0;        ///< its number in the frame
  uint64_t left_out = 0;    ///< in a last part: tiles that are not sampled, because a newer view overtook this one
  wire::Moments moments;    ///< moments up to its publication
  /// Master's clock: when it reached this machine, and when decoding began and ended.
  double arrived_s = 0, decode_begin_s = 0, decoded_s = 0;
};
ViewPart part_of(const wire::Patch& patch);

class ViewRequester {
 public:
  static constexpr double kDeadBand_px = 0.25;  ///< content at kNearest_m moves by less at rest
  static constexpr double kNearest_m = 0.3;
  static constexpr double kQuietPeriod_s = 1.0;  ///< period of repeated requests, which find unannounced changes
  static constexpr double kPatience_s = 0.5;     ///< with a view under way
  static constexpr double kSettles_s = 0.25;     ///< pictures: a head that rests this long asks once more
  static constexpr double kAskPatience_s = 0.5;  ///< without a wall's request, until it asks for its own head

  ViewRequester(const RequestOptions& options, InstanceId viewer)
      : options_(options), viewer_(viewer), head_(options.prediction) {}

  /// The viewer is another instance from now on.
  void set_viewer(InstanceId viewer) { viewer_ = viewer; }

  /// A displayed pose; display: the camera that showed it.
  void on_pose(double t_s, const geometry::Camera& display);
  /// Poses are given in another space, or belong to another head, from now on: past movement means nothing there.
  void on_jump() { head_.on_jump(); }
  /// The head's tracker expects it here at t_s, which lies ahead: this is better than a prediction from poses.
  void on_expected(double t_s, const geometry::Pose& pose) { head_.on_expected(t_s, pose); }
  /// All viewers of a wall ask for views of one head now, this viewer with this camera. While such requests come,
  /// nothing else is asked for asynchronously. ask: ViewRequest::ask.
  void on_ask(double now_s, uint64_t ask, const geometry::Camera& camera);
  /// Sets RequestOptions::min_scale from the session; within 0.1 to 1.
  void set_min_scale(double scale) { options_.min_scale = scale >= 0.1 ? std::min(scale, 1.0) : 0.1; }
  /// Sets the size of views from now on, by a person's wish.
  void set_sampling(const SamplingWish& wish);
  /// True: samplers cast only the rays that the model lacks. Then a view that was seen already costs next to nothing,
  /// and its size is no measure of its time.
  void set_steered(bool steered) { steered_ = steered; }
  /// Sets RequestOptions::buffers. If it was 0, only the newest request is still answered.
  void set_buffers(uint64_t buffers);
  /// Sets RequestOptions::pictures.
  void set_pictures(bool pictures) { options_.pictures = pictures; }
  /// True if the newest request waits for its answer.
  bool answer_open() const { return sent_ && open_.contains(sent_->request); }
  /// The scene changed: it may soon change again, and a still head would wait long for each of its views at full
  /// resolution. So views stay coarse for a while.
  void on_epoch(double now_s);
  /// Another epoch began: if views are pictures, a head that rests needs a new one.
  void on_new_epoch(double now_s) {
    if (options_.pictures) on_epoch(now_s);
  }
  /// Returns the next request; asynchronously, if one is due. A head that rests asks for exactly the same view again
  /// while it moves by less than kDeadBand_px. If sampling is steered, it asks only every kQuietPeriod_s while that
  /// view is under way, and after its update brought no points.
  ///   Requests keep to their rate: a late one does not delay those after it. If sampling is steered, a viewer's views
  ///   are sampled one after the other, so the next request goes out when the last view is complete, or has been under
  ///   way for kPatience_s: then the head is known best.
  std::optional<wire::ViewRequest> next(double now_s);
  /// Asynchronously: time until the next request may go out; nothing: it may go out now.
  std::optional<double> due_in_s(double now_s) const {
    return due_s_ > now_s ? std::optional(due_s_ - now_s) : std::nullopt;
  }
  /// Repeats these requests, for the view that is wanted now.
  std::vector<wire::ViewRequest> again(std::span<const RequestId> requests, double now_s);
  /// A frame that waited for its update was displayed `latency_s` after the update's request: predictions reach that
  /// far from now on.
  void on_displayed(double latency_s);
  /// Returns when it was requested; nothing: it is not ours, or has been answered.
  std::optional<double> requested_s(RequestId request) const;

  /// Received from extra rays.
  struct Extra {
    uint64_t points = 0, bytes = 0;
  };
  struct Update {
    RequestId request;
    uint64_t ahead = 0;  ///< requests that were open when it was sent: those are answered first
    /// first_s: the first part's time; it may be of the coarse pass.
    double requested_s = 0, first_s = 0, complete_s = 0;
    double posed_s = 0;  ///< when the displayed pose was new
    geometry::Camera camera;
    bool still = false;  ///< requested at full resolution, while the head rested
    /// Sums over all parts, with the coarse pass.
    uint64_t points = 0, samples = 0, bytes = 0, tiles = 0, eliminated = 0;
    Extra extra;  ///< since the update before
  };
  /// A part of a frame was applied. Returns the finished update if it was the last part at full resolution of our
  /// request; a coarse pass may come before it, with the same request.
  std::optional<Update> on_part(const ViewPart& part, double now_s);

  double latency_s() const { return latency_s_; }
  /// Time that poses are predicted ahead, seconds.
  double horizon_s() const;
  /// Errors of these predictions.
  tracking::PredictionMeter::Figures prediction() const { return head_.errors(); }

 private:
  double min_scale() const {
    return change_.changing() ? std::min(options_.min_scale, options_.min_scale_changing) : options_.min_scale;
  }
  /// asked: a camera whose pose needs no prediction; else null.
  geometry::Camera wanted(double now_s, bool& still, const geometry::Camera* asked = nullptr);
  geometry::Camera exactly_wanted(double now_s, bool& still, const geometry::Camera* asked);
  wire::ViewRequest request(RequestId id, const geometry::Camera& camera, double now_s, uint64_t buffers,
                            uint64_t ask) const;
  bool rests_at(const geometry::Pose& there, const geometry::Pose& here) const;
  bool quiet(const geometry::Camera& camera) const;
  bool waits_for_answer(double now_s) const;
  bool picture_due(double now_s);
  void follow_latency(const Update& update, double latency_s);

  RequestOptions options_;
  InstanceId viewer_;
  tracking::HeadForecast head_;
  SamplingScale scale_;
  SceneChange change_;
  std::optional<geometry::Camera> display_;
  double posed_s_ = 0;  // since when display_ has this pose
  RequestId next_{1};
  struct Ask {
    uint64_t number = 0;
    geometry::Camera camera;
  };
  std::optional<Ask> asked_;  // until it is sent
  double asked_s_ = -1e9;     // time of the newest on_ask()
  bool steered_ = false;
  std::optional<Update> sent_;             // the newest request
  std::optional<geometry::Camera> quiet_;  // camera of the last update without points
  bool settled_ = false;                   // pictures: the finer picture has been requested for the view that was sent
  double due_s_ = -1e9, latency_s_ = 0, displayed_latency_s_ = 0;
  Extra extra_;  // since the last update
  std::map<RequestId, Update> open_;
};

/// Counts credits of a viewer that waits (sync, loose). Requests, updates and frames go in as they happen, decisions
/// come out; no sockets, no clocks, no threads.
///   A request holds a credit from its sending until the frame that shows its update has been displayed. Updates are
///   displayed in the order of their requests, each in exactly one frame.
class Coupling {
 public:
  /// After this long without any sign of an answer, the master may have forgotten the requests (it was restarted) or
  /// found nothing to sample.
  static constexpr double kPatience_s = 2;

  /// buffers: as from buffers_of(); 0: asynchronous, nothing below applies and may_ask() is always true.
  /// newest: an update that comes makes those before it void, and holds no credit: it is displayed unless a newer one
  /// comes before.
  explicit Coupling(int buffers, bool newest = false) : buffers_(buffers), newest_(newest) {}
  int buffers() const { return buffers_; }
  bool waits() const { return buffers_ > 0; }
  /// Changes the number of buffers. Credits that are out stay out: with fewer buffers no request may go out until
  /// enough updates were displayed. 0: forgets all that is open or complete, and waits for nothing.
  void set_buffers(int buffers);
  void set_newest(bool newest) { newest_ = newest; }

  // ---- requests ----
  bool may_ask() const {
    const size_t here = newest_ ? 0 : ready_.size() + (displaying_ ? 1 : 0);
    return !waits() || open_.size() + here < size_t(buffers_);
  }
  /// Ids ascend from call to call.
  void asked(RequestId request, double now_s);
  bool is_open(RequestId request) const;
  /// A part of an answer came.
  void progress(double now_s) { heard_s_ = sign_s_ = now_s; }
  /// Returns when the newest part of an answer came; 0: no part has come yet.
  double last_sign_s() const { return sign_s_; }
  /// Answers come in the order of requests: those before this one will never be answered. Their credits become free.
  void skip_before(RequestId request);
  /// The update is complete. Returns the requests whose updates can be displayed from now on, in order; empty while an
  /// earlier one is open. A request that is not open changes nothing.
  std::vector<RequestId> completed(RequestId request, double now_s);
  /// After kPatience_s without an answer: returns the open requests, to be sent again; the master recognises their ids
  /// if it still has them. The patience begins anew. Empty: it is not over, or no request is open. If a later update is
  /// complete, the earlier requests are given up instead: `released` gets those that can be displayed now.
  std::vector<RequestId> overdue(double now_s, std::vector<RequestId>& released);
  /// Complete updates that wait for earlier ones will not be displayed: their credits become free.
  void drop_complete() {
    std::erase_if(open_, [](const Open& o) { return o.complete; });
  }
  /// Returns all open requests, to be sent again: another master took over, which does not know them.
  std::vector<RequestId> open() const;

  // ---- display ----
  /// Returns the next complete update, if there is one; its frame begins. Precondition: no frame is being displayed.
  std::optional<RequestId> take();
  /// The frame that take() began has been displayed: its credit becomes free. Without such a frame it does nothing.
  void displayed() { displaying_ = false; }
  /// Number of complete updates that wait to be displayed.
  int filled() const { return int(ready_.size()); }

 private:
  struct Open {
    RequestId request;
    bool complete = false;
  };
  std::vector<RequestId> release();

  int buffers_;
  bool newest_ = false;
  std::deque<Open> open_;
  std::deque<RequestId> ready_;
  bool displaying_ = false;
  double heard_s_ = 0;  // when a part of an answer came, or requests were sent again
  double sign_s_ = 0;
};

/// Connects the worker and the display thread: Coupling behind a lock, with a condition that the display waits on.
class CouplingGate {
 public:
  explicit CouplingGate(const CouplingState& state)
      : state_(state), coupling_(state.buffers, state.mode == CouplingMode::kImages) {}
  /// A coupling with this number of buffers: 0 async, 1 sync, else loose.
  explicit CouplingGate(int buffers)
      : CouplingGate({buffers == 0   ? CouplingMode::kAsync
                      : buffers == 1 ? CouplingMode::kSync
                                     : CouplingMode::kLoose,
                      buffers}) {}

  // ---- any thread ----
  CouplingState state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  int buffers() const { return state().buffers; }
  bool waits() const { return state().waits(); }

  // ---- worker ----
  /// Coupling::may_ask().
  bool may_ask();
  /// Does Coupling::asked(). Returns true if another view may be asked for at once.
  bool asked(RequestId request, double now_s);
  /// Changes the coupling (Coupling::set_buffers). Wakes a display that waits.
  void change(const CouplingState& state) {
    {
      const std::lock_guard lock(mutex_);
      state_ = state;
      coupling_.set_newest(state.mode == CouplingMode::kImages);
      coupling_.set_buffers(state.buffers);
    }
    changed_.notify_one();
  }

  /// Runs f(Coupling&) under the lock, then wakes the display if an update is there for it.
  template <class F>
  auto with(F&& f) {
    struct Wake {
      CouplingGate& gate;
      std::unique_lock<std::mutex> lock;
      ~Wake() {
        const bool there = gate.coupling_.filled() > 0;
        lock.unlock();
        if (there) gate.changed_.notify_one();
      }
    } wake{*this, std::unique_lock(mutex_)};
    return f(coupling_);
  }

  // ---- display ----
  struct Taken {
    CouplingState coupling;            ///< in force when the wait ended
    std::optional<RequestId> request;  ///< the next complete update; nothing: no update came in time
    double last_sign_s = 0;            ///< Coupling::last_sign_s()
    bool asked = false;                ///< a request waits for its answer
  };
  /// Takes the next complete update; waits for it for at most `timeout_s`. It does not wait while the coupling is
  /// asynchronous, also if that changes during the wait.
  Taken take(double timeout_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout_s),
                      [&] { return coupling_.filled() > 0 || !state_.waits(); });
    const auto next = coupling_.take();
    return {state_, next, coupling_.last_sign_s(), !coupling_.open().empty()};
  }
  void displayed() {
    const std::lock_guard lock(mutex_);
    coupling_.displayed();
  }
  int filled() const {
    const std::lock_guard lock(mutex_);
    return coupling_.filled();
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  CouplingState state_;
  Coupling coupling_;
};

}  // namespace telesplat::viewer
