#include "tools/telesplat/report/time_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tools/common/inference.h"
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

// A series a viewer, in the order in which they come.
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

// Times since the run's beginning, sums of bytes or numbers.
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

// When the frames of quality.csv were displayed. They are the first viewer's; without frames.csv its own clock counts.
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

ordered_json intervals_json(const RunTables& t) {
  ordered_json out = ordered_json::object();
  const auto add = [&](const char* key, const LooseTable& table, const std::vector<double>& column) {
    std::map<std::string_view, std::vector<double>> by_viewer;
    for (size_t row = 0; row < column.size(); ++row)
      if (std::isfinite(column[row])) by_viewer[table.texts("viewer")[row]].push_back(column[row]);
    std::vector<double> values;  // one viewer's after the other's
    for (const auto& [viewer, own] : by_viewer) values.insert(values.end(), own.begin(), own.end());
    const auto found = tools::block_intervals(values, std::array{0.5, 0.95});
    for (size_t i = 0; i < found.size(); ++i)
      out[fmt::format("{}_{}", key, i == 0 ? "median" : "p95")] = {rounded(found[i].low), rounded(found[i].high)};
  };
  if (t.frames) {
    add("m2p", *t.frames, t.of_drawn("motion_to_photon_ms"));
    add("delay", *t.frames, t.of_drawn("inter_frame_ms"));
  }
  if (t.updates) add("latency", *t.updates, t.updates->numbers("latency_ms"));
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
  // Of each part of the walk the frame with the longest delay stays.
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
    ahead_x.push_back(-2 * (x * z + w * y));  // of -z turned by the quaternion
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

}  // namespace telesplat::launcher
