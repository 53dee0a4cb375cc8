#include "common/metrics/sums/quantiles.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace telesplat::metrics {
namespace {

constexpr double kError = 0.005;                              // of a percentile, relative
constexpr double kLeast = 1e-9, kGreatest = 1e15;             // what is smaller or larger counts as these
const double kWidth = std::log1p(2 * kError / (1 - kError));  // of a bucket, in logarithms

int bucket_of(double size) { return int(std::ceil(std::log(std::clamp(size, kLeast, kGreatest)) / kWidth)); }
// The value that is no further than kError from all of its bucket.
double value_of(int bucket) { return std::exp(bucket * kWidth) * (1 - kError); }

}  // namespace

void Quantiles::add(double value) {
  if (!std::isfinite(value)) return;
  max_ = count_ ? std::max(max_, value) : value;
  ++count_;
  sum_ += value;
  const double from_mean = value - mean_;
  mean_ += from_mean / double(count_);
  squares_ += from_mean * (value - mean_);
  if (count_ <= kExact) return exact_.push_back(value);
  for (const double before : exact_) put(before);
  exact_ = {};
  put(value);
}

void Quantiles::put(double value) {
  if (value == 0)
    ++zeros_;
  else
    ++(value < 0 ? below_ : above_)[bucket_of(std::abs(value))];
}

double Quantiles::at(double p) const {
  auto left = uint64_t(p * double(count_ - 1));
  for (auto bucket = below_.rbegin(); bucket != below_.rend(); ++bucket) {
    if (left < bucket->second) return -value_of(bucket->first);
    left -= bucket->second;
  }
  if (left < zeros_) return 0;
  left -= zeros_;
  for (const auto& [bucket, count] : above_) {
    if (left < count) return std::min(max_, value_of(bucket));
    left -= count;
  }
  return max_;
}

Distribution Quantiles::distribution() const {
  if (count_ <= kExact) return metrics::distribution(exact_);
  return {sum_ / double(count_), at(0.5), at(0.95), at(0.99), max_, std::sqrt(squares_ / double(count_ - 1))};
}

nlohmann::ordered_json distribution_json(const Quantiles& values) {
  return values.empty() ? nlohmann::ordered_json() : to_json(values.distribution());
}

}  // namespace telesplat::metrics
