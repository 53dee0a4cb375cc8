// How often something may be done: some times in a row, then so often a second. No clocks.
#pragma once

#include <algorithm>

namespace telesplat::master {

class Pace {
 public:
  Pace(double in_a_row, double rate_s) : in_a_row_(in_a_row), rate_s_(rate_s), left_(in_a_row) {}

  bool allows(double now_s) const { return left(now_s) >= 1; }
  /// It is done, allowed or not.
  void count(double now_s) {
    left_ = std::max(0.0, left(now_s) - 1);
    at_s_ = now_s;
  }

 private:
  double left(double now_s) const { return std::min(in_a_row_, left_ + std::max(0.0, now_s - at_s_) * rate_s_); }
  double in_a_row_, rate_s_, left_, at_s_ = 0;
};

}  // namespace telesplat::master
