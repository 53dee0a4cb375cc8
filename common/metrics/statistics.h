// Distributions of measured values.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace telesplat::metrics {

struct Distribution {
  double mean = 0, median = 0, p95 = 0, p99 = 0, max = 0;
  double sd = 0;  ///< standard deviation, sqrt(sum of squared differences from the mean / (n - 1)); 0 of one value
};

/// Percentiles by linear interpolation between the nearest ranks; all 0 for no values. Values that are not finite are
/// left out.
Distribution distribution(std::vector<double> values);

/// digits: behind the point.
nlohmann::ordered_json to_json(const Distribution& d, int digits = 3);
/// The distribution of these values; null if there are none: nothing was measured.
nlohmann::ordered_json distribution_json(const std::vector<double>& values, int digits = 3);

}  // namespace telesplat::metrics
