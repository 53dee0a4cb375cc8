// Values measured in the last seconds, for people who watch: a bounded number. Thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <mutex>

namespace telesplat::viewer {

class RecentValues {
 public:
  static constexpr size_t kMost = 1024;  ///< values kept; beyond it the oldest is dropped

  /// Values older than window_s do not count.
  explicit RecentValues(double window_s) : window_s_(window_s) {}
  /// Precondition: now_s does not fall from call to call.
  void add(double now_s, double value);

  struct Figures {
    size_t count = 0;
    double median = 0, p95 = 0;  ///< as metrics::distribution() has them; 0 without values
  };
  /// Cost: that of sorting kMost values.
  Figures figures(double now_s) const;

 private:
  struct Value {
    double at_s, value;
  };
  const double window_s_;
  mutable std::mutex mutex_;
  std::array<Value, kMost> values_{};
  size_t next_ = 0, count_ = 0;
};

}  // namespace telesplat::viewer
