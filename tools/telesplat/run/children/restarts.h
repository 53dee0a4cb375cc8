// How often a process may die before its session gives it up, and how long it waits before it is started again. Times
// come in.
#pragma once

#include <algorithm>
#include <deque>

namespace telesplat::launcher {

class Restarts {
 public:
  /// A process that dies more often than this in this time is not started again.
  static constexpr int kMost = 5;
  static constexpr double kWithin_s = 60;
  /// The first in that time is followed at once, the next after this time, the one after that after twice this time,
  /// and so on.
  static constexpr double kWait_s = 0.25, kLongestWait_s = 4;

  /// How often it was started again in the time before now_s.
  int lately(double now_s) {
    while (!deaths_.empty() && deaths_.front() < now_s - kWithin_s) deaths_.pop_front();
    return static_cast<int>(deaths_.size());
  }
  /// It died, and is to be started again. Returns when.
  double died(double now_s) {
    const int before = lately(now_s);
    deaths_.push_back(now_s);
    ++all_;
    if (before == 0) return now_s;
    return now_s + std::min(kWait_s * static_cast<double>(1u << std::min(before - 1, 20)), kLongestWait_s);
  }
  /// In the whole session.
  int all() const { return all_; }

 private:
  std::deque<double> deaths_;
  int all_ = 0;
};

}  // namespace telesplat::launcher
