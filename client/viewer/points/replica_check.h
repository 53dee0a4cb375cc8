// Whether the replica is the packer's model, by their digests: marks of the packer tell its digest now and then. No
// clock: times come in.
#pragma once

#include <cstdint>

namespace telesplat::viewer {

class ReplicaCheck {
 public:
  /// After a difference the replica is made anew at once, then, if that did not help, after this time, twice this time,
  /// and so on: what never comes out equal shall not cost a link all it has.
  static constexpr double kPatience_s = 20, kLongest_s = 640;

  /// Both digests are of the same event. True: the replica is to be made anew from everything.
  bool compare(uint64_t packers, uint64_t ours, double now_s) {
    if (packers == ours) {
      ++equal_;
      patience_s_ = kPatience_s;
      return false;
    }
    ++different_;
    if (now_s < again_s_) return false;
    again_s_ = now_s + patience_s_;
    patience_s_ = patience_s_ * 2 < kLongest_s ? patience_s_ * 2 : kLongest_s;
    return true;
  }

  uint64_t equal() const { return equal_; }
  uint64_t different() const { return different_; }

 private:
  uint64_t equal_ = 0, different_ = 0;
  double patience_s_ = kPatience_s, again_s_ = -1e300;
};

}  // namespace telesplat::viewer
