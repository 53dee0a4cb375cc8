#include "client/viewer/record/recent_values.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/metrics/statistics.h"

namespace telesplat::viewer {

void RecentValues::add(double now_s, double value) {
  const std::lock_guard lock(mutex_);
  values_[next_] = {now_s, value};
  next_ = (next_ + 1) % kMost;
  count_ = std::min(count_ + 1, kMost);
}

RecentValues::Figures RecentValues::figures(double now_s) const {
  std::vector<double> recent;
  {
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < count_; ++i)
      if (values_[i].at_s >= now_s - window_s_) recent.push_back(values_[i].value);
  }
  const size_t count = recent.size();
  const metrics::Distribution d = metrics::distribution(std::move(recent));
  return {count, d.median, d.p95};
}

}  // namespace telesplat::viewer
