// How often a process may say hello: each one may change what everybody is told. No clocks.
#pragma once

#include <algorithm>

namespace telesplat::master {

class HelloPace {
 public:
  static constexpr double kAtOnce = 8;  ///< with its facts, as they become known
  static constexpr double kRate_s = 4;  ///< then so many a second: as often as one that is not welcomed says it

  bool allows(double now_s) const { return left(now_s) >= 1; }
  /// Precondition: allows(now_s).
  void count(double now_s) {
    left_ = left(now_s) - 1;
    at_s_ = now_s;
  }

 private:
  double left(double now_s) const { return std::min(kAtOnce, left_ + std::max(0.0, now_s - at_s_) * kRate_s); }
  double left_ = kAtOnce, at_s_ = 0;
};

}  // namespace telesplat::master
