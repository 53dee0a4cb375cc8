// What measured values allow to say: how far off a figure may be, and whether two sets of runs differ. All intervals
// have 95 % confidence.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace telesplat::tools {

struct Interval {
  double low = 0, high = 0;
};

/// Of the mean of values that do not depend on each other, as those of repeated runs: mean -+ t(0.975; n - 1) s /
/// sqrt(n) (Student 1908). Nothing: there are fewer than two values.
std::optional<Interval> mean_interval(std::span<const double> values);

/// mean(b) - mean(a).
struct Difference {
  double mean = 0;
  Interval interval;
  double p = 1;  ///< two-sided
};
/// Welch's t test (1947): the variances of the two need not be equal. Ranks (Mann and Whitney) tell nothing of three
/// runs a side, whose smallest p is 0.1. Nothing: one of them has fewer than two values.
std::optional<Difference> difference(std::span<const double> a, std::span<const double> b);

/// p values of a family of tests, raised so that a difference is found by mistake in at most as many families as they
/// say (Holm 1979).
std::vector<double> holm(const std::vector<double>& p);

}  // namespace telesplat::tools
