// How many views are asked for ahead where the servers draw them (--coupling images): as many as keep samplers and link
// busy, and no more, for a view that waits is one of the past. After TCP Vegas (Brakmo, Peterson 1995): what a view
// takes longer than one that nothing goes before is the time that it waited, and so tells how many wait. No sockets, no
// clocks.
#pragma once

#include <algorithm>

#include "common/wire/limits.h"

namespace telesplat::viewer {

class PipelineDepth {
 public:
  static constexpr int kFirst = 2, kMost = int(wire::kMaxBuffers);
  /// Views that wait somewhere: with fewer the next round has one more under way, with more one less.
  static constexpr double kFewWait = 0.5, kManyWait = 1.5;

  /// Views under way at most.
  int depth() const { return depth_; }

  /// A view came latency_s after it had been asked for; ahead: views that were under way then.
  void answered(double latency_s, int ahead) {
    // A view that had all for itself tells what one takes now; others at most that it takes no longer.
    if (ahead == 0)
      least_s_ = least_s_ == 0 ? latency_s : least_s_ + kShare * (latency_s - least_s_);
    else
      least_s_ = least_s_ == 0 ? latency_s : std::min(least_s_, latency_s);
    sum_s_ += latency_s;
    filled_ = filled_ && ahead + 1 >= depth_;
    if (++count_ < depth_) return;
    const double wait = depth_ * (1 - least_s_ * count_ / sum_s_);
    // Where fewer were under way than might have been, more are of no use.
    if (wait > kManyWait)
      depth_ = std::max(1, depth_ - 1);
    else if (wait < kFewWait && filled_)
      depth_ = std::min(kMost, depth_ + 1);
    count_ = 0, sum_s_ = 0, filled_ = true;
  }

 private:
  static constexpr double kShare = 0.3;  // of a new value in least_s_
  int depth_ = kFirst, count_ = 0;
  double least_s_ = 0, sum_s_ = 0;  // 0: nothing is known
  bool filled_ = true;
};

}  // namespace telesplat::viewer
