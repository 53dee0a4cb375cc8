// How the display and the server wait for each other (T6.3-6.5): the modes and their names. view_requester.h has the
// credits.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/camera.h"
#include "common/wire/limits.h"
#include "common/wire/session_messages.h"

namespace telesplat::viewer {

/// async: the display shows what is there, requests go out at a rate. sync: ask, wait, display one frame, ask again.
/// loose: the same with up to `buffers` requests on their way or complete and not displayed, so that server and display
/// work at the same time. images: the servers draw views; the display waits for the next picture and shows the newest
/// that is there; as many requests are on their way as PipelineDepth says.
enum class CouplingMode { kAsync, kSync, kLoose, kImages };

std::optional<CouplingMode> coupling_named(std::string_view name);
const char* coupling_name(CouplingMode mode);
/// ViewRequest::buffers: 0, 1, `loose`, or PipelineDepth::kFirst.
int buffers_of(CouplingMode mode, int loose);

/// A coupling with its buffers, as buffers_of() has them.
struct CouplingState {
  CouplingMode mode = CouplingMode::kAsync;
  int buffers = 0;
  bool waits() const { return buffers > 0; }
  bool operator==(const CouplingState&) const = default;
};
/// loose: buffers of loose coupling.
CouplingState coupling_state(CouplingMode mode, int loose);
/// "async", "sync", "loose, 3 buffers".
std::string coupling_text(const CouplingState& state);
/// As the session's settings have it. nullopt: the viewer keeps its own.
std::optional<CouplingState> coupling_told(wire::CouplingOrder order, uint64_t buffers);

/// Where the display waits for view updates: what it does and says when none comes for long (docs/coupling.md).
/// Times come in.
class StallWatch {
 public:
  static constexpr double kLong_s = 1;   ///< a wait that is told to people
  static constexpr double kMost_s = 10;  ///< without any sign of an answer; then frames are drawn from what is there

  explicit StallWatch(double most_s = kMost_s) : most_s_(most_s) {}

  /// No update has come by now_s, in a wait that began at begin_s. last_sign_s: when part of an answer last came. True:
  /// a frame is to be drawn from what is there, and so is every further one until an update comes.
  bool waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling);
  /// An update came, or nothing is waited for any more.
  void over(double now_s);

  /// How long it has waited; 0: not for long enough to tell people.
  double told_s(double now_s) const { return told_ ? now_s - *since_s_ : 0; }
  /// What is to be logged, once: when a wait begins to be long, when frames are drawn from what is there, when it is
  /// over.
  std::optional<std::string> take_news();

 private:
  double most_s_;
  std::optional<double> since_s_;  // the wait began
  bool told_ = false, draws_ = false;
  std::optional<std::string> news_;
};

/// How many views are asked for ahead where the servers draw them (--coupling images): as many as keep samplers and
/// link busy, and no more, for a view that waits is one of the past. Each view tells how long it waited for
/// somebody who was busy; on the way it waited for what a view takes longer than one that nothing goes before, as
/// in TCP Vegas (Brakmo, Peterson 1995). No sockets, no clocks.
class PipelineDepth {
 public:
  static constexpr int kFirst = 2, kMost = int(wire::kMaxBuffers);
  /// Views that wait somewhere: with fewer the next round has one more under way, with more one less.
  static constexpr double kFewWait = 0.5, kManyWait = 1.5;

  /// A view that came.
  struct View {
    double latency_ms = 0;  ///< since it was asked for
    double queued_ms = 0;   ///< of it, in queues
    double network_ms = 0;  ///< of it, on the way
    int ahead = 0;          ///< views that were under way when it was asked for
  };

  /// Views under way at most.
  int depth() const { return depth_; }

  void answered(const View& v) {
    // A view that had the way for itself tells what it takes now; others at most that it takes no longer.
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
    // Where fewer were under way than might have been, more are of no use.
    if (wait > kManyWait)
      depth_ = std::max(1, depth_ - 1);
    else if (wait < kFewWait && filled_)
      depth_ = std::min(kMost, depth_ + 1);
    count_ = 0, sum_ms_ = waited_ms_ = 0, filled_ = true;
  }

 private:
  static constexpr double kShare = 0.3;  // of a new value in least_ms_
  int depth_ = kFirst, count_ = 0;
  double least_ms_ = 0;  // on the way; 0: nothing is known
  double sum_ms_ = 0, waited_ms_ = 0;
  bool filled_ = true;
};

/// The view update that a displayed frame shows: what its age and its error are counted from.
struct ShownUpdate {
  RequestId request;
  double requested_s = 0;  ///< master's clock
  geometry::Pose pose;     ///< that was asked for
  double posed_s = 0;      ///< master's clock: the head was there, unless it was predicted
};

}  // namespace telesplat::viewer
