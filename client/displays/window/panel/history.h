// What a plot shows: values of the last seconds.
#pragma once

#include <deque>
#include <vector>

namespace telesplat::viewer {

/// Values as they come, each with its time; those older than the span are forgotten. One thread.
class History {
 public:
  static constexpr size_t kMost = 4096;  ///< values; more in the span push out the oldest

  explicit History(double span_s) : span_s_(span_s) {}

  /// A value that is not finite is ignored. A time before the newest one begins the history anew.
  void add(double t_s, double value);
  bool empty() const { return samples_.empty(); }
  /// The newest value; 0 where there is none.
  double newest() const { return samples_.empty() ? 0 : samples_.back().value; }
  double span_s() const { return span_s_; }

  /// The span before `now_s` in `count` columns, the oldest first: the largest value of each, so that a single peak is
  /// seen; where none falls into a column the one before goes on; NaN before the first.
  std::vector<float> columns(double now_s, size_t count) const;

 private:
  struct Sample {
    double t_s, value;
  };
  double span_s_;
  std::deque<Sample> samples_;
};

}  // namespace telesplat::viewer
