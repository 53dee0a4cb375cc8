#include "tools/common/inference.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <random>

namespace telesplat::tools {
namespace {

constexpr double kTail = 0.025;

struct Moments {
  double n = 0, mean = 0, variance = 0;  // variance: divided by n - 1
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

}  // namespace telesplat::tools
