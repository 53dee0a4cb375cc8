// Which view to ask for next, and when (T6.3-6.5): what it shows, by poses of the past, and whether the display and the
// server wait for each other.
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
#include "client/viewer/tracking/pose_predictor.h"
#include "client/viewer/tracking/prediction_meter.h"
#include "common/geometry/camera.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// What to sample for a display of width x height pixels: the size of the options, or as many pixels in the display's
/// aspect, sides multiples of 8 and at least 16.
std::pair<int, int> sampling_size(const RequestOptions& options, int width, int height);

/// What came of an answer: a tile of points, or a whole volume frame.
struct ViewPart {
  InstanceId viewer;
  RequestId request;
  EpochId epoch;
  FrameId frame;
  bool complete = false;  ///< the last part of the frame of full resolution
  bool extra = false;     ///< of rays beyond what the view asked for: it belongs to no update
  uint64_t tiles = 1, points = 0, samples = 0, bytes = 0;
  geometry::Camera camera;  ///< that was sampled
  uint64_t eliminated = 0;  ///< samples of which no points came, because the model has them already
  uint64_t tile = 0;        ///< its number in the frame
  uint64_t left_out = 0;    ///< of a last part: tiles that are not sampled, because a newer view overtook this one
  wire::Moments moments;    ///< as far as it was published
  /// Master's clock: it reached this machine; decoding began and was over.
  double arrived_s = 0, decode_begin_s = 0, decoded_s = 0;
};
ViewPart part_of(const wire::Patch& patch);

class ViewRequester {
 public:
  static constexpr double kDeadBand_px = 0.25;  ///< of anything that is kNearest_m away or farther
  static constexpr double kNearest_m = 0.3;
  static constexpr double kQuietPeriod_s = 1.0;  ///< what has changed without a word is found by asking again
  static constexpr double kPatience_s = 0.5;     ///< with a view on its way
  static constexpr double kSettles_s = 0.25;     ///< pictures: a head that rests so long is asked for once more
  static constexpr double kAskPatience_s = 0.5;  ///< until views are asked for of the own head again

  ViewRequester(const RequestOptions& options, InstanceId viewer)
      : options_(options), viewer_(viewer), predictor_(options.prediction) {}

  /// The viewer is another instance from now on.
  void set_viewer(InstanceId viewer) { viewer_ = viewer; }

  /// A displayed pose; display: the camera it was shown with.
  void on_pose(double t_s, const geometry::Camera& display);
  /// Poses from now on are told in another space, or of another head: how it moved before means nothing.
  void on_jump();
  /// Who tracks the head expects it here at t_s, which lies ahead: better than what its poses alone tell.
  void on_expected(double t_s, const geometry::Pose& pose) { expected_ = {t_s, pose}; }
  /// Of a wall: all of its viewers ask for views of one head now, this one with this camera. While such words come,
  /// nothing else is asked for asynchronously. ask: wire::ViewRequest.
  void on_ask(double now_s, uint64_t ask, const geometry::Camera& camera);
  /// RequestOptions::min_scale, as the session sets it; within 0.1 to 1.
  void set_min_scale(double scale) { options_.min_scale = scale >= 0.1 ? std::min(scale, 1.0) : 0.1; }
  /// The size of views from now on, as a person wishes it.
  void set_sampling(const SamplingWish& wish);
  /// Whether samplers cast only the rays that the model lacks: then a view that was seen already costs next to nothing,
  /// and its size is no measure of its time.
  void set_steered(bool steered) { steered_ = steered; }
  /// RequestOptions::buffers from now on. Where that was 0, nothing but the newest request is answered any more.
  void set_buffers(uint64_t buffers);
  /// RequestOptions::pictures from now on.
  void set_pictures(bool pictures) { options_.pictures = pictures; }
  /// Whether the newest request waits for its answer.
  bool answer_open() const { return open_.contains(sent_id_); }
  /// The scene changed: for a while it may change again, and a still head would wait long for each of its views at full
  /// resolution.
  void on_epoch(double now_s);
  /// Another epoch began: of pictures, the view of a head that rests is another one.
  void on_new_epoch(double now_s) {
    if (options_.pictures) on_epoch(now_s);
  }
  /// The next request; asynchronously, if one is due. A head that rests asks for exactly the same view again while it
  /// moves by less than kDeadBand_px. Where sampling is steered, it asks only every kQuietPeriod_s while its view is on
  /// its way, and after an update of it that brought no points.
  ///   Requests keep to their rate: one that is late does not make the following ones late. Where sampling is steered,
  ///   a viewer's views are sampled one after the other, so the next one is asked for when the last one is complete, or
  ///   has been on its way for kPatience_s: then the head is known best.
  std::optional<wire::ViewRequest> next(double now_s);
  /// Asynchronously: when the next request may go out, if that is not yet.
  std::optional<double> due_in_s(double now_s) const {
    return due_s_ > now_s ? std::optional(due_s_ - now_s) : std::nullopt;
  }
  /// These requests once more, for the view that is wanted now.
  std::vector<wire::ViewRequest> again(std::span<const RequestId> requests, double now_s);
  /// A frame that waited for its update was displayed so long after the update had been requested: predictions reach to
  /// there.
  void on_displayed(double latency_s);
  /// When it was requested; nothing: not by us, or it has been answered.
  std::optional<double> requested_s(RequestId request) const;

  struct Update {
    RequestId request;
    uint64_t ahead = 0;  ///< requests that were open when it was sent: it is answered after them
    /// first_s: the first part, of the coarse pass if there is one.
    double requested_s = 0, first_s = 0, complete_s = 0;
    double posed_s = 0;  ///< the displayed pose was new then
    geometry::Camera camera;
    bool still = false;  ///< asked for at full resolution, while the head rested
    /// The coarse pass included.
    uint64_t points = 0, samples = 0, bytes = 0, tiles = 0, eliminated = 0;
    uint64_t extra_points = 0, extra_bytes = 0;  ///< of extra rays that came since the update before
  };
  /// Part of a frame was applied. Returns the finished update when it was the last part of the frame of full resolution
  /// and asked for by us; a coarse pass may come before it, with the same request.
  std::optional<Update> on_part(const ViewPart& part, double now_s);

  double latency_s() const { return latency_s_; }
  /// How far ahead poses are predicted.
  double horizon_s() const;
  /// How well they were.
  tracking::PredictionMeter::Figures prediction() const { return meter_.figures(); }

 private:
  RequestOptions options_;
  InstanceId viewer_;
  tracking::PosePredictor predictor_;
  tracking::PredictionMeter meter_;
  std::optional<tracking::PosePredictor::Sample> expected_;
  std::optional<geometry::Camera> display_;
  double posed_s_ = 0;  // since when it is that
  RequestId next_{1};
  double scale_ = 0;  // adaptive: sampled pixels a displayed pixel on each axis; 0: not begun
  double min_scale() const {
    return changing_ ? std::min(options_.min_scale, options_.min_scale_changing) : options_.min_scale;
  }

  geometry::Pose expected_at(double t_s) const;
  /// asked: where the head will be is known.
  geometry::Camera wanted(double now_s, bool& still, const geometry::Camera* asked = nullptr);
  geometry::Camera exactly_wanted(double now_s, bool& still, const geometry::Camera* asked);
  wire::ViewRequest request(RequestId id, const geometry::Camera& camera, double now_s, uint64_t buffers,
                            uint64_t ask) const;
  bool rests_at(const geometry::Pose& there, const geometry::Pose& here) const;
  bool quiet(const geometry::Camera& camera) const;
  bool waits_for_answer(double now_s) const;
  bool picture_due(double now_s);
  void follow_latency(const Update& update, double latency_s);
  void step_scale(double own_s, const Update& update);

  struct Ask {
    uint64_t number = 0;
    geometry::Camera camera;
  };
  std::optional<Ask> asked_;  // that is not sent yet
  double asked_s_ = -1e9;     // the newest

  bool steered_ = false;
  std::optional<geometry::Camera> sent_, quiet_;  // of the last request; of the last update, if it brought no points
  RequestId sent_id_;
  bool settled_ = false;                         // pictures: of the view that was sent a finer one has been asked for
  uint64_t extra_points_ = 0, extra_bytes_ = 0;  // since the last update
  int slow_ = 0, fast_ = 0;                      // updates in a row that took too long, that left time
  bool changing_ = false;                        // the scene; as of the last request
  double last_sent_s_ = -1e9, due_s_ = -1e9, latency_s_ = 0, displayed_latency_s_ = 0, epoch_began_s_ = -1e9,
         last_update_s_ = -1e9;
  std::map<RequestId, Update> open_;
};

/// Requests, updates and frames go in as they happen, decisions come out; no sockets, no clocks, no threads.
///   Credits of a viewer that waits (sync, loose). A request holds a credit from when it is sent until the frame that
/// shows its update has been displayed. Updates are displayed in the order of their requests, each in exactly one
/// frame.
class Coupling {
 public:
  /// Without any sign of an answer for so long the master may have forgotten the requests (it was restarted) or found
  /// nothing to sample.
  static constexpr double kPatience_s = 2;

  /// buffers: as buffers_of(); 0: asynchronous, nothing below applies and may_ask() is always true.
  /// newest: an update that comes makes those before it void, and holds no credit: it is displayed unless a newer one
  /// comes before.
  explicit Coupling(int buffers, bool newest = false) : buffers_(buffers), newest_(newest) {}
  int buffers() const { return buffers_; }
  bool waits() const { return buffers_ > 0; }
  /// From now on there are so many. Credits that are out stay out: with fewer buffers than before nothing may be asked
  /// for until enough updates were displayed. 0: what is open or complete is forgotten, nothing is waited for any more.
  void set_buffers(int buffers);
  void set_newest(bool newest) { newest_ = newest; }

  // ---- requests ----
  bool may_ask() const {
    const size_t here = newest_ ? 0 : ready_.size() + (displaying_ ? 1 : 0);
    return !waits() || open_.size() + here < size_t(buffers_);
  }
  /// Ids ascend.
  void asked(RequestId request, double now_s);
  bool is_open(RequestId request) const;
  /// Part of an answer came.
  void progress(double now_s) { heard_s_ = sign_s_ = now_s; }
  /// When the newest part of an answer came; 0: none ever.
  double last_sign_s() const { return sign_s_; }
  /// Answers come in the order of requests: those before this one will not be answered any more. Their credits are
  /// free.
  void skip_before(RequestId request);
  /// The update is complete. Returns the requests whose updates can be displayed from now on, in order: none while an
  /// earlier one is open. One that is not open changes nothing.
  std::vector<RequestId> completed(RequestId request, double now_s);
  /// Nothing came for kPatience_s: the open requests, which are to be sent again - the master knows them by their ids,
  /// if it does. The patience begins anew. Empty: it is not over, or nothing is open. Where a later update is complete,
  /// the earlier ones are given up instead: `released` gets those that can be displayed now.
  std::vector<RequestId> overdue(double now_s, std::vector<RequestId>& released);
  /// What is complete and waits for earlier ones will not be displayed: its credits are free.
  void drop_complete() {
    std::erase_if(open_, [](const Open& o) { return o.complete; });
  }
  /// Another master: it knows nothing of what is open. All of it is to be sent again.
  std::vector<RequestId> open() const;

  // ---- display ----
  /// The next update that is complete, if one is; its frame begins. Precondition: no frame is being displayed.
  std::optional<RequestId> take();
  /// The frame that take() began has been displayed: its credit is free. Without one: no effect.
  void displayed() { displaying_ = false; }
  /// Complete updates that wait to be displayed.
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
  double heard_s_ = 0;  // a part of an answer, or the requests were sent again
  double sign_s_ = 0;
};

/// Where the worker and the display thread meet: Coupling behind a lock, with a condition that the display waits on.
class CouplingGate {
 public:
  explicit CouplingGate(const CouplingState& state)
      : state_(state), coupling_(state.buffers, state.mode == CouplingMode::kImages) {}
  /// What has so many buffers: 0 async, 1 sync, else loose.
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
  /// Coupling::asked(). Returns whether another view may be asked for at once.
  bool asked(RequestId request, double now_s);
  /// Another coupling from now on (Coupling::set_buffers). A display that waits is woken.
  void change(const CouplingState& state) {
    {
      const std::lock_guard lock(mutex_);
      state_ = state;
      coupling_.set_newest(state.mode == CouplingMode::kImages);
      coupling_.set_buffers(state.buffers);
    }
    changed_.notify_one();
  }

  /// Runs f(Coupling&) alone; wakes the display if an update is there for it afterwards.
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
    std::optional<RequestId> request;  ///< the next complete update; none: there was none in time
    double last_sign_s = 0;            ///< Coupling::last_sign_s()
    bool asked = false;                ///< some request waits for its answer
  };
  /// The next complete update, waited for at most `timeout_s`; not at all where the coupling is asynchronous, also if
  /// that is changed meanwhile.
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
