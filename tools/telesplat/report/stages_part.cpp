// Where the time of view updates went: stages.csv.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <unordered_map>

#include "common/metrics/statistics.h"
#include "tools/telesplat/report/reading/thinning.h"
#include "tools/telesplat/report/reading/update_stages.h"
#include "tools/telesplat/report/time_part.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

std::vector<double> finite_of(const std::vector<double>& values) {
  std::vector<double> out;
  std::copy_if(values.begin(), values.end(), std::back_inserter(out), [](double v) { return std::isfinite(v); });
  return out;
}

double mean_of(const std::vector<double>& values) {
  return values.empty() ? NAN : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

// share: of the mean latency.
ordered_json row_of(const std::vector<double>& values, double mean_latency) {
  const auto finite = finite_of(values);
  if (finite.empty()) return nullptr;
  const auto d = metrics::distribution(finite);
  return {{"median", rounded(d.median)},
          {"p95", rounded(d.p95)},
          {"mean", rounded(d.mean)},
          {"share", rounded(d.mean / mean_latency)}};
}

// The rows to show over time: of each of at most `most` parts, equal in number of updates, the slowest.
std::vector<size_t> slowest_rows(const LooseTable& stages, size_t most) {
  std::vector<size_t> rows;
  const auto& requested = stages.numbers("requested_s");
  const auto& latency = stages.numbers("latency_ms");
  for (size_t row = 0; row < stages.rows(); ++row)
    if (std::isfinite(requested[row]) && std::isfinite(latency[row])) rows.push_back(row);
  std::stable_sort(rows.begin(), rows.end(), [&](size_t a, size_t b) { return requested[a] < requested[b]; });
  const size_t parts = std::min(most, rows.size());
  std::vector<size_t> out;
  for (size_t k = 0; k < parts; ++k)
    out.push_back(*std::max_element(rows.begin() + long(k * rows.size() / parts),
                                    rows.begin() + long((k + 1) * rows.size() / parts),
                                    [&](size_t a, size_t b) { return latency[a] < latency[b]; }));
  return out;
}

// Of each row who sampled the part whose way the stages follow: of its frame's tiles the one that was published last
// (docs/metrics.md, "Joining the tables"). Null: nobody did, or it is not known.
ordered_json samplers_of(const RunTables& t, const std::vector<size_t>& rows) {
  const auto& frames = t.stages->numbers("frame");
  struct Last {
    double published_s = -INFINITY;
    const std::string* sampler = nullptr;
  };
  std::unordered_map<double, Last> last;  // by frame
  for (const size_t row : rows)
    if (std::isfinite(frames[row])) last[frames[row]];
  if (t.tiles) {
    const auto &frame = t.tiles->numbers("frame"), &published_s = t.tiles->numbers("published_s");
    const auto& sampler = t.tiles->texts("sampler");
    for (size_t tile = 0; tile < t.tiles->rows(); ++tile)
      if (const auto found = last.find(frame[tile]);
          found != last.end() && published_s[tile] > found->second.published_s)
        found->second = {published_s[tile], &sampler[tile]};
  }
  ordered_json out = ordered_json::array();
  for (const size_t row : rows) {
    const auto found = last.find(frames[row]);
    const bool known = found != last.end() && found->second.sampler && !found->second.sampler->empty();
    out.push_back(known ? ordered_json(*found->second.sampler) : ordered_json());
  }
  return out;
}

// How far the stages are from adding up to the latency, and how many of them are negative.
void check_sums(const LooseTable& stages, ordered_json& out) {
  size_t negative = 0;
  double off = 0;
  const auto& latency = stages.numbers("latency_ms");
  std::vector<const std::vector<double>*> columns;
  for (const auto& c : kUpdateStages)
    if (stages.has(c.column)) columns.push_back(&stages.numbers(c.column));
  for (size_t row = 0; row < stages.rows(); ++row) {
    double sum = 0;
    for (const auto* column : columns) {
      const double ms = (*column)[row];
      if (std::isfinite(ms)) sum += ms;
      negative += ms < 0;
    }
    if (latency[row] > 0) off = std::max(off, std::abs(sum - latency[row]) / latency[row]);
  }
  out["negative"] = negative;
  out["off"] = rounded(off, 3);
}

}  // namespace

ordered_json stages_json(const RunTables& t, const PageLimits& limits) {
  if (!t.stages) return nullptr;
  const LooseTable& stages = *t.stages;
  if (std::none_of(std::begin(kUpdateStages), std::end(kUpdateStages),
                   [&](const UpdateStage& s) { return stages.has(s.column); }))
    return nullptr;
  const double mean_latency = mean_of(finite_of(stages.numbers("latency_ms")));
  const auto rows = slowest_rows(stages, limits.stacked_updates);
  const auto column = [&](const char* name, double offset, int digits) {
    std::vector<double> values;
    for (const size_t row : rows) values.push_back(stages.numbers(name)[row] - offset);
    return rounded_json(values, digits);
  };
  ordered_json out{{"of", stages.rows()},
                   {"t", column("requested_s", t.origin_s, 7)},
                   {"request", column("request", 0, 12)},
                   {"frame", column("frame", 0, 12)},
                   {"tile", column("tile", 0, 12)},
                   {"latency", column("latency_ms", 0, 5)},
                   {"stages", ordered_json::array()}};
  out["sampler"] = samplers_of(t, rows);
  for (const auto& c : kUpdateStages) {
    if (!stages.has(c.column)) continue;
    out["stages"].push_back({{"key", c.column},
                             {"label", c.label},
                             {"group", stage_group(c.column)},
                             {"v", column(c.column, 0, 4)},
                             {"row", row_of(stages.numbers(c.column), mean_latency)}});
  }
  out["latency_row"] = row_of(stages.numbers("latency_ms"), mean_latency);
  out["display_row"] = row_of(stages.numbers("display_ms"), mean_latency);
  check_sums(stages, out);
  return out;
}

}  // namespace telesplat::launcher
