// Modes in which display and server wait for each other (T6.3-6.5), and their names. view_requester.h has the credits.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/camera.h"
#include "common/wire/limits.h"
#include "common/wire/session_messages.h"

namespace telesplat::viewer {

/// async: the display shows what is there; requests go out at a rate. sync: ask, wait, display one frame, ask again.
/// loose: the same with up to `buffers` requests that are under way or complete and not displayed, so that server and
/// display work at the same time. images: the servers draw views; the display waits for the next picture and shows the
/// newest; PipelineDepth sets the number of requests under way.
enum class CouplingMode { kAsync, kSync, kLoose, kImages };

std::optional<CouplingMode> coupling_named(std::string_view name);
const char* coupling_name(CouplingMode mode);
/// Returns ViewRequest::buffers: 0, 1, `loose`, or PipelineDepth::kFirst.
int buffers_of(CouplingMode mode, int loose);

/// A mode with its buffers, as from buffers_of().
struct CouplingState {
  CouplingMode mode = CouplingMode::kAsync;
  int buffers = 0;
  bool waits() const { return buffers > 0; }
  bool operator==(const CouplingState&) const = default;
};
/// loose: number of buffers, if the mode is loose.
CouplingState coupling_state(CouplingMode mode, int loose);
/// "async", "sync", "loose, 3 buffers".
std::string coupling_text(const CouplingState& state);
/// Converts the session's setting. nullopt: the viewer keeps its own.
std::optional<CouplingState> coupling_told(wire::CouplingOrder order, uint64_t buffers);

/// Watches a display that waits for view updates: decides what to do and to log if no update comes for long
/// (docs/coupling.md). The caller gives the times.
class StallWatch {
 public:
  static constexpr double kLong_s = 1;   ///< a wait this long is reported to people
  static constexpr double kMost_s = 10;  ///< without any sign of an answer; then frames are drawn from what is there

  explicit StallWatch(double most_s = kMost_s) : most_s_(most_s) {}

  /// No update has come by now_s, in a wait that began at begin_s. last_sign_s: when a part of an answer last came.
  /// True: draw this frame and all later ones from what is there, until an update comes.
  bool waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling);
  /// An update came, or the display waits no more.
  void over(double now_s);

  /// Returns how long it has waited, in seconds; 0: less than kLong_s.
  double told_s(double now_s) const { return told_ ? now_s - *since_s_ : 0; }
  /// Returns a line to log, once each: when a wait becomes long, when frames are drawn from what is there, when the
  /// wait is over.
  std::optional<std::string> take_news();

 private:
  double most_s_;
  std::optional<double> since_s_;  // when the wait began
  bool told_ = false, draws_ = false;
  std::optional<std::string> news_;
};

/// Chooses the number of views to ask for ahead if the servers draw them (--coupling images): as many as keep samplers
/// and link busy. More would only make pictures older. Each view brings the time that it waited in queues; its wait in
/// the network is its time beyond that of a view that was alone, as in TCP Vegas (Brakmo, Peterson 1995). No sockets,
/// no clocks.
class PipelineDepth {
 public:
  static constexpr int kFirst = 2, kMost = int(wire::kMaxBuffers);
  /// Mean number of views that wait: below kFewWait the next round has one more under way, above kManyWait one less.
  static constexpr double kFewWait = 0.5, kManyWait = 1.5;

  /// A view that arrived.
  struct View {
    double latency_ms = 0;  ///< since its request
    double queued_ms = 0;   ///< part of that: in queues
    double network_ms = 0;  ///< part of that: in the network
    int ahead = 0;          ///< views that were under way at its request
  };

  /// Number of views to keep under way.
  int depth() const { return depth_; }

  void answered(const View& v) {
    // A view that was alone shows the network's time now; with others before it, its time is an upper bound.
    if (least_ms_ == 0)
      least_ms_ = v.network_ms;
    else if (v.ahead == 0)
      least_ms_ += kShare * (v.network_ms - least_ms_);
    else
      least_ms_ = std::min(least_ms_, v.network_ms);
    sum_ms_ += v.latency_ms;
    waited_ms_ += v.queued_ms + std::max(0.0, v.network_ms - least_ms_);
    filled_ = filled_ && v.ahead + 1 >= depth_;
    if (++count_ < depth_) return;
    const double wait = depth_ * waited_ms_ / sum_ms_;
    // If fewer views were under way than allowed, a higher limit would not help.
    if (wait > kManyWait)
      depth_ = std::max(1, depth_ - 1);
    else if (wait < kFewWait && filled_)
      depth_ = std::min(kMost, depth_ + 1);
    count_ = 0, sum_ms_ = waited_ms_ = 0, filled_ = true;
  }

 private:
  static constexpr double kShare = 0.3;  // weight of a new value in least_ms_
  int depth_ = kFirst, count_ = 0;
  double least_ms_ = 0;  // time of a view that is alone in the network; 0: not known
  double sum_ms_ = 0, waited_ms_ = 0;
  bool filled_ = true;
};

/// The view update in a displayed frame: its age and its error are counted from these values.
struct ShownUpdate {
  RequestId request;
  double requested_s = 0;  ///< master's clock
  geometry::Pose pose;     ///< the requested pose
  double posed_s = 0;      ///< master's clock: when the head was there, unless it was predicted
};

}  // namespace telesplat::viewer
