// How many views are asked for ahead where the servers draw them (--coupling images): as many as keep samplers and link
// busy, and no more, for a view that waits is one of the past. Each view tells how long it waited for somebody who was
// busy; on the way it waited for what a view takes longer than one that nothing goes before, as in TCP Vegas (Brakmo,
// Peterson 1995). No sockets, no clocks.
#pragma once

#include <algorithm>

#include "common/wire/limits.h"

namespace telesplat::viewer {

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

}  // namespace telesplat::viewer
