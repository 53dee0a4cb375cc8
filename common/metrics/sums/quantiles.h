// Distributions of values that go on for hours, in bounded memory.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "common/metrics/statistics.h"

namespace telesplat::metrics {

/// Keeps values as they are while they are few; then how many lie in each of buckets whose bounds grow by 1 %, which
/// gives percentiles to half a percent of their value. Count, sum, greatest value and standard
/// deviation are exact always.
class Quantiles {
 public:
  static constexpr size_t kExact = 8192;  ///< values that are kept as they are

  /// Values that are not finite are left out.
  void add(double value);
  uint64_t count() const { return count_; }
  bool empty() const { return count_ == 0; }
  double sum() const { return sum_; }
  /// All 0 for no values.
  Distribution distribution() const;

 private:
  void put(double value);
  double at(double p) const;

  std::vector<double> exact_;              // empty once there are more
  std::map<int, uint64_t> below_, above_;  // buckets of what is negative and positive, by the logarithm of its size
  uint64_t zeros_ = 0, count_ = 0;
  double sum_ = 0, max_ = 0;
  double mean_ = 0, squares_ = 0;  // of differences from it (Welford 1962)
};

/// null if there are no values: nothing was measured.
nlohmann::ordered_json distribution_json(const Quantiles& values);

}  // namespace telesplat::metrics
