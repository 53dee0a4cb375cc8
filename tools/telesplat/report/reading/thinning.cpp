#include "tools/telesplat/report/reading/thinning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/core/check.h"
#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

constexpr int kBinsPerOctave = 16;
constexpr double kLeastBinned = 1.0 / 64;  // ms; lower values count in its bin
constexpr double kSlack = 1.05;            // times a display's period
constexpr int kQuantiles = 400;

// Value at a share of the way through sorted values, linear between neighbours.
double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * double(sorted.size() - 1);
  const size_t below = size_t(at), above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - double(below)) * (sorted[above] - sorted[below]);
}

ordered_json bins_of(const std::vector<double>& values) {
  std::map<int, size_t> counts;
  for (const double v : values) ++counts[int(std::floor(std::log2(std::max(v, kLeastBinned)) * kBinsPerOctave))];
  ordered_json out = ordered_json::array();
  for (const auto& [bin, count] : counts) out.push_back({bin, count});
  return out;
}

// Evenly spaced, and closer at the slowest values.
ordered_json quantiles_of(const std::vector<double>& sorted) {
  std::vector<double> shares;
  for (int i = 0; i <= kQuantiles; ++i) shares.push_back(double(i) / kQuantiles);
  for (const double share : {0.999, 0.9995, 0.9999}) shares.push_back(share);
  std::sort(shares.begin(), shares.end());
  ordered_json out = ordered_json::array();
  for (const double share : shares) out.push_back({rounded(quantile(sorted, share)), share});
  return out;
}

}  // namespace

Series tidy(Series series) {
  CHECK(series.t_s.size() == series.values.size());
  std::vector<size_t> order;
  for (size_t i = 0; i < series.size(); ++i)
    if (std::isfinite(series.t_s[i]) && std::isfinite(series.values[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return series.t_s[a] < series.t_s[b]; });
  Series out;
  for (const size_t i : order) out.add(series.t_s[i], series.values[i]);
  return out;
}

Series thinned(const Series& series, size_t buckets) {
  if (series.size() <= 2 * buckets) return series;
  const double begin = series.t_s.front(), length = series.t_s.back() - begin;
  const auto bucket = [&](size_t i) {
    return length > 0 ? std::min(buckets - 1, size_t((series.t_s[i] - begin) / length * double(buckets))) : size_t{0};
  };
  Series out;
  for (size_t i = 0; i < series.size();) {
    size_t least = i, most = i, end = i;
    for (const size_t mine = bucket(i); end < series.size() && bucket(end) == mine; ++end) {
      if (series.values[end] < series.values[least]) least = end;
      if (series.values[end] > series.values[most]) most = end;
    }
    const size_t first = std::min(least, most), second = std::max(least, most);
    out.add(series.t_s[first], series.values[first]);
    if (second != first) out.add(series.t_s[second], series.values[second]);
    i = end;
  }
  return out;
}

double rounded(double value, int digits) {
  if (!std::isfinite(value) || value == 0) return value;
  const double scale = std::pow(10.0, digits - 1 - int(std::floor(std::log10(std::abs(value)))));
  // Goes through text if the scale would lose bits: numbers must be short when written.
  if (!std::isfinite(scale) || scale == 0) return value;
  const double near = std::round(value * scale);
  return scale >= 1 ? near / scale : near * std::round(1 / scale);
}

ordered_json rounded_json(const std::vector<double>& values, int digits) {
  ordered_json out = ordered_json::array();
  for (const double v : values)
    if (std::isfinite(v))
      out.push_back(rounded(v, digits));
    else
      out.push_back(nullptr);
  return out;
}

ordered_json series_json(const std::string& label, const Series& series, size_t buckets) {
  const Series all = tidy(series), few = thinned(all, buckets);
  ordered_json t = ordered_json::array();
  for (const double s : few.t_s) t.push_back(std::round(s * 1e4) / 1e4);
  return {{"label", label}, {"t", std::move(t)}, {"v", rounded_json(few.values)}, {"of", all.size()}};
}

Series rate(const std::vector<double>& t_s, const std::vector<double>& amounts, double begin_s, double end_s,
            double bin_s) {
  CHECK(bin_s > 0 && t_s.size() == amounts.size());
  Series out;
  if (!(end_s > begin_s)) return out;
  const size_t bins = size_t(std::ceil((end_s - begin_s) / bin_s));
  std::vector<double> sums(bins, 0.0);
  for (size_t i = 0; i < t_s.size(); ++i) {
    if (!std::isfinite(t_s[i]) || !std::isfinite(amounts[i]) || t_s[i] < begin_s || t_s[i] > end_s) continue;
    sums[std::min(bins - 1, size_t((t_s[i] - begin_s) / bin_s))] += amounts[i];
  }
  for (size_t k = 0; k < bins; ++k) {
    const double from = begin_s + double(k) * bin_s, to = std::min(from + bin_s, end_s);
    // A very short last part would have a rate by chance.
    if (to - from < bin_s / 10 && k > 0) continue;
    out.add((from + to) / 2, sums[k] / (to - from));
  }
  return out;
}

ordered_json spread_json(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const auto d = metrics::distribution(values);
  ordered_json within;
  for (const int hz : {60, 72, 90}) {
    const auto end = std::upper_bound(values.begin(), values.end(), kSlack * 1000 / hz);
    within[fmt::format("{}", hz)] = rounded(double(end - values.begin()) / double(values.size()));
  }
  return {{"n", values.size()},    {"mean", rounded(d.mean)}, {"median", rounded(d.median)},
          {"p95", rounded(d.p95)}, {"p99", rounded(d.p99)},   {"max", rounded(d.max)},
          {"sd", rounded(d.sd)},   {"bins", bins_of(values)}, {"quantiles", quantiles_of(values)},
          {"within", within}};
}

}  // namespace telesplat::launcher
