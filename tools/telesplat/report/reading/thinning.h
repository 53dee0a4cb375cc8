// Long rows of measurements made short enough for a page, so that nothing that stands out is lost.
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

/// Without moments or values that are not finite, in order of time.
Series tidy(Series series);

/// At most 2 x `buckets` points: the time is cut into `buckets` equal parts, and of each the least and the greatest
/// value stay, where they were. A series that is as short stays as it is. Precondition: tidy.
Series thinned(const Series& series, size_t buckets);

/// To `digits` significant decimal digits; what is not finite stays so.
double rounded(double value, int digits = 5);
/// An array of numbers; null for what is not finite.
nlohmann::ordered_json rounded_json(const std::vector<double>& values, int digits = 5);

/// {"label", "t": [...], "v": [...], "of": points before they were thinned}; times to 0.1 ms.
nlohmann::ordered_json series_json(const std::string& label, const Series& series, size_t buckets);

/// What comes in a second: sums of `amounts` over parts of `bin_s` seconds from begin_s to end_s, each at its middle.
/// Amounts that are not finite, or come at no finite time or outside, do not count. The last part may be shorter; it
/// counts by its length. Preconditions: bin_s > 0; one amount a moment.
Series rate(const std::vector<double>& t_s, const std::vector<double>& amounts, double begin_s, double end_s,
            double bin_s);

/// How values are distributed: {"n", "mean", "median", "p95", "p99", "max", "sd", "bins": [[first edge's exponent,
/// count]], "quantiles": [[value, share of values up to it]], "within": {"60": share, ...}}; null if there are none.
/// A bin k holds values from 2^(k/16) to 2^((k+1)/16), so that bins of all runs are the same. `within` tells the share
/// of values at most 5 % longer than the period of that many Hz, in ms.
nlohmann::ordered_json spread_json(std::vector<double> values);

}  // namespace telesplat::launcher
