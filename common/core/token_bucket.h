// Limits how often an event may happen.
#pragma once

#include <algorithm>

namespace telesplat {

/// Lets through `rate` a second on average, and `burst` at once after a quiet time.
class TokenBucket {
 public:
  TokenBucket(double rate, double burst) : rate_(rate), burst_(burst), tokens_(burst) {}

  /// True if one more event may happen now.
  bool take(double now_s) {
    tokens_ = std::min(burst_, tokens_ + std::max(0.0, now_s - last_s_) * rate_);
    last_s_ = std::max(last_s_, now_s);
    if (tokens_ < 1) return false;
    tokens_ -= 1;
    return true;
  }
  double last_s() const { return last_s_; }  ///< time of the last call of take()

 private:
  double rate_, burst_, tokens_, last_s_ = -1e300;
};

}  // namespace telesplat
