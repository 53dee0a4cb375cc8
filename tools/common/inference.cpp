#include "tools/common/inference.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <random>

namespace telesplat::tools {
namespace {

constexpr double kTail = 0.025;
constexpr size_t kResamples = 1000, kLeastResamples = 200;
constexpr double kMostDraws = 4e6;

struct Moments {
  double n = 0, mean = 0, variance = 0;  // of n - 1
};
Moments moments_of(std::span<const double> values) {
  Moments out{double(values.size()), 0, 0};
  out.mean = std::accumulate(values.begin(), values.end(), 0.0) / out.n;
  for (const double v : values) out.variance += (v - out.mean) * (v - out.mean) / (out.n - 1);
  return out;
}

double quantile_of_t(double degrees) {
  return boost::math::quantile(boost::math::complement(boost::math::students_t(degrees), kTail));
}

// Between the nearest ranks. Reorders the values.
double percentile(std::vector<double>& values, double share) {
  const double rank = share * double(values.size() - 1);
  const auto below = values.begin() + long(rank);
  std::nth_element(values.begin(), below, values.end());
  const double part = rank - std::floor(rank);
  if (part == 0) return *below;
  return *below + part * (*std::min_element(below + 1, values.end()) - *below);
}

}  // namespace

std::optional<Interval> mean_interval(std::span<const double> values) {
  if (values.size() < 2) return std::nullopt;
  const Moments m = moments_of(values);
  const double off = quantile_of_t(m.n - 1) * std::sqrt(m.variance / m.n);
  return Interval{m.mean - off, m.mean + off};
}

std::optional<Difference> difference(std::span<const double> a, std::span<const double> b) {
  if (a.size() < 2 || b.size() < 2) return std::nullopt;
  const Moments of_a = moments_of(a), of_b = moments_of(b);
  const double va = of_a.variance / of_a.n, vb = of_b.variance / of_b.n, mean = of_b.mean - of_a.mean;
  if (!(va + vb > 0)) return Difference{mean, {mean, mean}, mean == 0 ? 1.0 : 0.0};
  const double degrees = (va + vb) * (va + vb) / (va * va / (of_a.n - 1) + vb * vb / (of_b.n - 1));
  const double error = std::sqrt(va + vb), off = quantile_of_t(degrees) * error;
  const double beyond =
      boost::math::cdf(boost::math::complement(boost::math::students_t(degrees), std::abs(mean) / error));
  return Difference{mean, {mean - off, mean + off}, std::min(1.0, 2 * beyond)};
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<size_t> order(p.size());
  std::iota(order.begin(), order.end(), size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return p[a] < p[b]; });
  std::vector<double> out(p.size());
  double before = 0;
  for (size_t i = 0; i < order.size(); ++i)
    out[order[i]] = before = std::max(before, std::min(1.0, double(order.size() - i) * p[order[i]]));
  return out;
}

size_t block_length(std::span<const double> values) {
  const auto n = double(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double all = 0, neighbours = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    all += (values[i] - mean) * (values[i] - mean);
    if (i > 0) neighbours += (values[i] - mean) * (values[i - 1] - mean);
  }
  const double r = all > 0 ? std::clamp(std::abs(neighbours / all), 0.0, 0.999) : 0;
  const double factor = std::max(1.0, std::pow(std::sqrt(6.0) * r / (1 - r * r), 2.0 / 3));
  return size_t(std::clamp(std::ceil(factor * std::cbrt(n)), 1.0, std::max(1.0, n / 4)));
}

std::vector<Interval> block_intervals(std::span<const double> values, std::span<const double> shares) {
  const size_t n = values.size();
  if (n < kLeastForBlocks) return {};
  const size_t length = block_length(values);
  const size_t resamples = std::clamp(size_t(kMostDraws / double(n)), kLeastResamples, kResamples);
  std::mt19937_64 random(1);
  std::uniform_int_distribution<size_t> begin(0, n - 1);
  std::vector<std::vector<double>> found(shares.size());
  std::vector<double> again(n);
  for (size_t i = 0; i < resamples; ++i) {
    for (size_t at = 0; at < n;) {
      const size_t from = begin(random), take = std::min(length, n - at), straight = std::min(take, n - from);
      std::copy_n(values.begin() + long(from), straight, again.begin() + long(at));
      std::copy_n(values.begin(), take - straight, again.begin() + long(at + straight));
      at += take;
    }
    for (size_t s = 0; s < shares.size(); ++s) found[s].push_back(percentile(again, shares[s]));
  }
  std::vector<Interval> out;
  for (auto& f : found) {
    const double low = percentile(f, kTail);
    out.push_back({low, percentile(f, 1 - kTail)});
  }
  return out;
}

}  // namespace telesplat::tools
