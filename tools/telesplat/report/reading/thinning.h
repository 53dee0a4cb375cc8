// Shortens long rows of measurements for a page, and keeps every peak.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace telesplat::launcher {

/// Values at moments, in order of time.
struct Series {
  std::vector<double> t_s, values;
  void add(double t, double value) { t_s.push_back(t), values.push_back(value); }
  size_t size() const { return t_s.size(); }
};

/// Drops moments and values that are not finite, and sorts by time.
Series tidy(Series series);

/// Returns at most 2 x `buckets` points: cuts the time into `buckets` equal parts and keeps the least and the greatest
/// value of each, at their times. A series of at most that many points stays as it is. Precondition: tidy.
Series thinned(const Series& series, size_t buckets);

/// Rounds to `digits` significant decimal digits; a value that is not finite stays.
double rounded(double value, int digits = 5);
/// An array of numbers; null for values that are not finite.
nlohmann::ordered_json rounded_json(const std::vector<double>& values, int digits = 5);

/// {"label", "t": [...], "v": [...], "of": points before thinning}; times to 0.1 ms.
nlohmann::ordered_json series_json(const std::string& label, const Series& series, size_t buckets);

/// Rate per second: sums of `amounts` over parts of `bin_s` seconds from begin_s to end_s, each at its middle. Amounts
/// that are not finite, or whose time is not finite or outside, do not count. A shorter last part is divided by its
/// length. Preconditions: bin_s > 0; one amount a moment.
Series rate(const std::vector<double>& t_s, const std::vector<double>& amounts, double begin_s, double end_s,
            double bin_s);

/// Distribution of values: {"n", "mean", "median", "p95", "p99", "max", "sd", "bins": [[first edge's exponent, count]],
/// "quantiles": [[value, share of values up to it]], "within": {"60": share, ...}}; null without values. Bin k holds
/// values from 2^(k/16) to 2^((k+1)/16), so that all runs have the same bins. `within`: share of values (ms) at most 5
/// % longer than the period of that many Hz.
nlohmann::ordered_json spread_json(std::vector<double> values);

}  // namespace telesplat::launcher
