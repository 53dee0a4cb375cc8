// Statistics of measured values: how exact a mean is, and whether two sets of runs differ. All intervals have 95 %
// confidence.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace telesplat::tools {

struct Interval {
  double low = 0, high = 0;
};

/// Interval of the mean of independent values, such as those of repeated runs: mean -+ t(0.975; n - 1) s / sqrt(n)
/// (Student 1908). Nothing: there are fewer than two values.
std::optional<Interval> mean_interval(std::span<const double> values);

/// mean(b) - mean(a).
struct Difference {
  double mean = 0;
  Interval interval;
  double p = 1;  ///< two-sided
};
/// Welch's t test (1947): the variances of the two need not be equal. A test of ranks (Mann and Whitney) is no use for
/// three runs a side: its smallest p is 0.1. Nothing: a or b has fewer than two values.
std::optional<Difference> difference(std::span<const double> a, std::span<const double> b);

/// Raises the p values of a family of tests: the share of families with a difference found by mistake is then at most
/// the p that is asked for (Holm 1979).
std::vector<double> holm(const std::vector<double>& p);

}  // namespace telesplat::tools
