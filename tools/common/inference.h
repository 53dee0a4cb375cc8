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

inline constexpr size_t kLeastForBlocks = 40;  ///< values

/// Of percentiles (shares, 0..1) of values in the order of time, which depend on those before them, as frames do: the
/// circular block bootstrap (Politis and Romano 1992), with blocks of block_length(). One interval a share; none: there
/// are fewer than kLeastForBlocks values. The same values give the same intervals.
std::vector<Interval> block_intervals(std::span<const double> values, std::span<const double> shares);

/// (sqrt(6) r / (1 - r^2))^(2/3) n^(1/3) of a correlation r of neighbours (Carlstein 1986, eq. 1.3), at least n^(1/3),
/// at most n / 4.
size_t block_length(std::span<const double> values);

}  // namespace telesplat::tools
