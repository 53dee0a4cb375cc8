#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <unordered_map>

#include "common/metrics/statistics.h"
#include "tools/telesplat/report/parts.h"
#include "tools/telesplat/report/reading/run_tables.h"
#include "tools/telesplat/report/reading/thinning.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

constexpr double kBytesOfRawSample = 8, kBytesOfSlicePixel = 4;  // data_generating_rate_mb_s (docs/metrics.md)
constexpr double kBytesOfPoint = 12;                             // data_consuming_rate_mb_s
constexpr double kMega = 1e6;
constexpr double kLeastBin_s = 0.5;
constexpr int kMostBins = 600;

double bin_of(const RunTables& t) { return std::max(kLeastBin_s, t.duration_s() / kMostBins); }

// A series for each viewer, in order of appearance.
template <class Value>
ordered_json by_viewer(const LooseTable& table, const std::vector<double>& at_s, double offset_s,
                       const PageLimits& limits, Value&& value) {
  std::vector<std::string> names;
  std::map<std::string, Series> all;
  const auto& viewers = table.texts("viewer");
  for (size_t row = 0; row < table.rows(); ++row) {
    const double v = value(row);
    if (!std::isfinite(v)) continue;
    const auto [at, fresh] = all.try_emplace(viewers[row]);
    if (fresh) names.push_back(viewers[row]);
    at->second.add(at_s[row] - offset_s, v);
  }
  ordered_json out = ordered_json::array();
  const size_t buckets = limits.buckets / std::max<size_t>(1, names.size());
  for (const auto& name : names) out.push_back(series_json(name, all[name], std::max<size_t>(buckets, 200)));
  return out;
}

void keep(ordered_json& out, const char* name, ordered_json series) {
  if (!series.empty()) out[name] = std::move(series);
}

void add_frames(const RunTables& t, const PageLimits& limits, ordered_json& out) {
  const LooseTable& frames = *t.frames;
  const auto plain = [&](const char* name, double scale = 1) {
    const auto& column = frames.numbers(name);
    keep(out, name, by_viewer(frames, t.frame_s, 0, limits, [&](size_t row) { return column[row] * scale; }));
  };
  for (const char* name : {"motion_to_photon_ms", "inter_frame_ms", "construction_ms"}) {
    const auto column = t.of_drawn(name);
    keep(out, name, by_viewer(frames, t.frame_s, 0, limits, [&](size_t row) { return column[row]; }));
  }
  for (const char* name : {"points_drawn", "points_cached", "update_age_ms", "view_error_deg"}) plain(name);
  const auto& error = frames.numbers("view_error_m");
  keep(out, "view_error_mm", by_viewer(frames, t.frame_s, 0, limits, [&](size_t row) { return error[row] * 1000; }));
}

ordered_json one(const char* label, const Series& series, const PageLimits& limits) {
  if (series.size() == 0) return ordered_json::array();
  return ordered_json::array({series_json(label, series, limits.buckets)});
}

// Rates of bytes or numbers, at times since the run's beginning.
Series rate_of(const RunTables& t, std::vector<double> at_s, std::vector<double> amounts, double scale) {
  for (double& s : at_s) s -= t.origin_s;
  for (double& a : amounts) a *= scale;
  return rate(at_s, amounts, 0, t.duration_s(), bin_of(t));
}

void add_updates(const RunTables& t, const PageLimits& limits, ordered_json& out) {
  const LooseTable& updates = *t.updates;
  const auto& complete = updates.numbers("complete_s");
  const auto& latency = updates.numbers("latency_ms");
  keep(out, "latency_ms", by_viewer(updates, complete, t.origin_s, limits, [&](size_t row) { return latency[row]; }));
  keep(out, "updates_per_s",
       one("all viewers", rate_of(t, complete, std::vector<double>(updates.rows(), 1.0), 1), limits));
  std::vector<double> points = updates.numbers("points");
  const auto& extra = updates.numbers("extra_points");
  for (size_t i = 0; i < points.size(); ++i)
    if (!t.slices && std::isfinite(extra[i])) points[i] += extra[i];
  const double bytes = t.slices ? kBytesOfSlicePixel : kBytesOfPoint;
  keep(out, "consuming_mb_s", one("added", rate_of(t, complete, points, bytes / kMega), limits));
}

void add_tiles(const RunTables& t, const PageLimits& limits, ordered_json& out) {
  const LooseTable& tiles = *t.tiles;
  const double bytes = t.slices ? kBytesOfSlicePixel : kBytesOfRawSample;
  keep(out, "generating_mb_s",
       one("sampled",
           rate_of(t, tiles.numbers("encode_end_s"), tiles.numbers(t.slices ? "kept" : "samples"), bytes / kMega),
           limits));
  std::vector<double> sent_s = tiles.numbers("published_s");
  const auto& packed = tiles.numbers("packed_s");
  for (size_t i = 0; i < sent_s.size(); ++i)
    if (!std::isfinite(sent_s[i])) sent_s[i] = packed[i];
  keep(out, "transfer_mb_s", one("sent", rate_of(t, sent_s, tiles.numbers("bytes_sent"), 1 / kMega), limits));
}

// Returns when the first viewer displayed the frames of quality.csv; without frames.csv by that viewer's clock.
std::vector<double> quality_s(const RunTables& t) {
  std::map<double, double> shown;
  if (t.frames) {
    const auto& number = t.frames->numbers("frame");
    const auto& viewers = t.frames->texts("viewer");
    for (size_t row = 0; row < number.size(); ++row)
      if (viewers[row] == viewers.front() && std::isfinite(number[row])) shown.emplace(number[row], t.frame_s[row]);
  }
  std::vector<double> out;
  const auto& number = t.quality->numbers("frame");
  const auto& own = t.quality->numbers("t_s");
  for (size_t row = 0; row < number.size(); ++row) {
    const auto found = std::isfinite(number[row]) ? shown.find(number[row]) : shown.end();
    out.push_back(found != shown.end() ? found->second : own[row]);
  }
  return out;
}

void add_quality(const RunTables& t, const PageLimits& limits, ordered_json& out) {
  const auto at_s = quality_s(t);
  const auto& objects = t.quality->numbers("object_pixels");
  for (const auto& [name, column, scale] :
       {std::tuple{"psnr_db", "psnr_db", 1.0}, {"holes_percent", "hole_fraction", 100.0}, {"flip", "flip", 1.0}}) {
    Series series;
    const auto& values = t.quality->numbers(column);
    for (size_t row = 0; row < at_s.size(); ++row)
      if (objects[row] > 0) series.add(at_s[row], values[row] * scale);
    keep(out, name, one("verified frames", series, limits));
  }
}

using nlohmann::ordered_json;

std::vector<double> finite_of(const std::vector<double>& values) {
  std::vector<double> out;
  std::copy_if(values.begin(), values.end(), std::back_inserter(out), [](double v) { return std::isfinite(v); });
  return out;
}

double mean_of(const std::vector<double>& values) {
  return values.empty() ? NAN : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

// mean_latency: the row gives its share of it.
ordered_json row_of(const std::vector<double>& values, double mean_latency) {
  const auto finite = finite_of(values);
  if (finite.empty()) return nullptr;
  const auto d = metrics::distribution(finite);
  return {{"median", rounded(d.median)},
          {"p95", rounded(d.p95)},
          {"mean", rounded(d.mean)},
          {"share", rounded(d.mean / mean_latency)}};
}

// Chooses the rows to show over time: the slowest of each of at most `most` parts with equal numbers of updates.
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

// Returns for each row the sampler of the tile that the stages follow: the last one published of its frame's tiles
// (docs/metrics.md, "Joining the tables"). Null: not sampled, or unknown.
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

// Adds the largest difference between latency and the stages' sum, and the number of negative stages.
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

ordered_json time_series(const RunTables& t, const PageLimits& limits) {
  ordered_json out = ordered_json::object();
  if (t.frames) add_frames(t, limits, out);
  if (t.updates) add_updates(t, limits, out);
  if (t.tiles) add_tiles(t, limits, out);
  if (t.quality) add_quality(t, limits, out);
  return out;
}

ordered_json spreads(const RunTables& t) {
  ordered_json out = ordered_json::object();
  if (t.frames) {
    for (const char* name : {"motion_to_photon_ms", "inter_frame_ms", "construction_ms"})
      out[name] = spread_json(t.of_drawn(name));
    out["update_age_ms"] = spread_json(t.frames->numbers("update_age_ms"));
  }
  if (t.updates) {
    out["latency_ms"] = spread_json(t.updates->numbers("latency_ms"));
    out["start_up_ms"] = spread_json(t.updates->numbers("start_up_ms"));
  }
  return out;
}

ordered_json walk_json(const RunTables& t, const PageLimits& limits) {
  if (!t.frames) return nullptr;
  const LooseTable& f = *t.frames;
  std::vector<size_t> rows;
  const auto& viewers = f.texts("viewer");
  for (size_t row = 0; row < f.rows(); ++row)
    if (viewers[row] == viewers.front() && std::isfinite(t.frame_s[row]) && std::isfinite(f.numbers("px")[row]) &&
        std::isfinite(f.numbers("pz")[row]))
      rows.push_back(row);
  if (rows.empty()) return nullptr;
  // Keeps the frame with the longest delay of each part of the walk.
  const size_t parts = std::min(limits.poses, rows.size());
  std::vector<size_t> chosen;
  const auto& delay = f.numbers("inter_frame_ms");
  for (size_t k = 0; k < parts; ++k) {
    const size_t from = k * rows.size() / parts, to = (k + 1) * rows.size() / parts;
    chosen.push_back(*std::max_element(rows.begin() + long(from), rows.begin() + long(to),
                                       [&](size_t a, size_t b) { return delay[a] < delay[b]; }));
  }
  const auto column = [&](const char* name, int digits = 4) {
    std::vector<double> values;
    for (const size_t row : chosen) values.push_back(f.numbers(name)[row]);
    return rounded_json(values, digits);
  };
  std::vector<double> t_s, ahead_x, ahead_z;
  for (const size_t row : chosen) {
    const double w = f.numbers("qw")[row], x = f.numbers("qx")[row], y = f.numbers("qy")[row], z = f.numbers("qz")[row];
    t_s.push_back(t.frame_s[row]);
    ahead_x.push_back(-2 * (x * z + w * y));  // x of -z turned by the quaternion
    ahead_z.push_back(-(1 - 2 * (x * x + y * y)));
  }
  return {{"viewer", viewers.front()},
          {"of", rows.size()},
          {"t", rounded_json(t_s, 7)},
          {"frame", column("frame", 9)},
          {"x", column("px")},
          {"y", column("py")},
          {"z", column("pz")},
          {"ahead_x", rounded_json(ahead_x, 3)},
          {"ahead_z", rounded_json(ahead_z, 3)},
          {"inter_frame_ms", column("inter_frame_ms")},
          {"update_age_ms", column("update_age_ms")},
          {"view_error_deg", column("view_error_deg")}};
}

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
