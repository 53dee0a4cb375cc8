// Distributions of measured values.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace telesplat::metrics {

struct Distribution {
  double mean = 0, median = 0, p95 = 0, p99 = 0, max = 0;
  double sd = 0;  ///< standard deviation, sqrt(sum of squared differences from the mean / (n - 1)); 0 for one value
};

/// Percentiles by linear interpolation between the nearest ranks; all 0 without values. Leaves out values that are not
/// finite.
Distribution distribution(std::vector<double> values);

/// digits: behind the point.
nlohmann::ordered_json to_json(const Distribution& d, int digits = 3);
/// The distribution of these values; null without values: nothing was measured.
nlohmann::ordered_json distribution_json(const std::vector<double>& values, int digits = 3);

}  // namespace telesplat::metrics
