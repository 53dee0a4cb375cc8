// Compares the replica with the packer's model by their digests: marks of the packer bring its digest from time to
// time. No clock: times come in.
#pragma once

#include <cstdint>
#include <utility>

#include "common/core/ids.h"

namespace telesplat::viewer {

class ReplicaCheck {
 public:
  /// After a difference the replica is made anew at once, and again after this time, twice this time, ..., at most
  /// kMostAnew times in a row with one packer: a replica that never becomes equal must not use up a link.
  static constexpr double kPatience_s = 20;
  static constexpr int kMostAnew = 3;

  enum class Verdict {
    kGoOn,
    kAskAnew,  ///< make the replica anew from everything
    kGiveUp,   ///< returned once: kMostAnew attempts failed, and there are no more until digests are equal
  };
  /// Both digests are for the same event.
  Verdict compare(InstanceId packer, uint64_t packers, uint64_t ours, double now_s) {
    if (std::exchange(packer_, packer) != packer || packers == ours) anew_ = 0, again_s_ = -1e300;
    if (packers == ours) return ++equal_, Verdict::kGoOn;
    ++different_;
    if (now_s < again_s_ || anew_ > kMostAnew) return Verdict::kGoOn;
    again_s_ = now_s + kPatience_s * double(1 << anew_);
    return ++anew_ > kMostAnew ? Verdict::kGiveUp : Verdict::kAskAnew;
  }

  uint64_t equal() const { return equal_; }
  uint64_t different() const { return different_; }

 private:
  uint64_t equal_ = 0, different_ = 0;
  InstanceId packer_;
  int anew_ = 0;  // attempts in a row; one more after giving up
  double again_s_ = -1e300;
};

}  // namespace telesplat::viewer
