#include "common/metrics/statistics.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

namespace telesplat::metrics {

Distribution distribution(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double p) {
    const double rank = p * static_cast<double>(values.size() - 1);
    const auto below = static_cast<size_t>(rank);
    const size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
  };
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, at(0.5), at(0.95), at(0.99), values.back(), n > 1 ? std::sqrt(squares / (n - 1)) : 0};
}

nlohmann::ordered_json to_json(const Distribution& d, int digits) {
  const double scale = std::pow(10, digits);
  const auto rounded = [&](double v) { return std::round(v * scale) / scale; };
  return {{"mean", rounded(d.mean)}, {"median", rounded(d.median)}, {"p95", rounded(d.p95)},
          {"p99", rounded(d.p99)},   {"max", rounded(d.max)},       {"sd", rounded(d.sd)}};
}

nlohmann::ordered_json distribution_json(const std::vector<double>& values, int digits) {
  const bool any = std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  return any ? to_json(distribution(values), digits) : nlohmann::ordered_json();
}

}  // namespace telesplat::metrics
