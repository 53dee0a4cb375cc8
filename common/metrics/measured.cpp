#include "common/metrics/measured.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/metrics/stages.h"

namespace telesplat::metrics {
namespace {

constexpr size_t kMostCouplings = 256, kMostOpenSkews = 1024;
constexpr double kMostLost = 1e6;  // frames in a row: a larger step is no loss but another count

std::string coupling_name(double mode, double buffers) {
  if (mode == 0) return "async";
  if (mode == 3) return "images";
  return mode == 1 ? "sync" : fmt::format("loose({:.0f})", buffers);
}

}  // namespace

/// A row of a table, whose values are found by the names of their columns.
struct Measured::Row {
  const std::vector<std::string>& columns;
  std::span<const double> values;

  std::optional<double> of(const char* name) const {
    const auto c = std::find(columns.begin(), columns.end(), name);
    return c == columns.end() ? std::nullopt : std::optional(values[size_t(c - columns.begin())]);
  }
  void add_to(Quantiles& quantiles, const char* name) const {
    if (const auto value = of(name)) quantiles.add(*value);
  }
};

double ViewerFigures::per_second(uint64_t count) const {
  return duration_s > 0 ? double(count) / std::max(duration_s, 1e-9) : 0;
}

double ViewerFigures::fps() const {
  const double drawn_s = duration_s - still_s;
  if (still == 0) return per_second(frames);
  return frames > still + 1 && drawn_s > 0 ? double(frames - still) / drawn_s : 0;
}

Table* Measured::table(const std::string& name) {
  if (name == "frames") return &frames_;
  if (name == "updates") return &updates_;
  if (name == "stages") return &stages_;
  return nullptr;
}

ViewerFigures& Measured::viewer_of(const std::string& name) {
  return viewers_[viewers_.size() < kMostViewers || viewers_.contains(name) ? name : "others"];
}

Status Measured::add(const std::string& viewer, const wire::MetricRows& more) {
  Table& table = *this->table(more.table);
  const size_t width = more.columns.size();
  if (width == 0 || more.values.size() % width)
    return Error{
        fmt::format("table {}: {} values do not fill rows of {} columns", more.table, more.values.size(), width)};
  if (!table.columns.empty() && table.columns != more.columns)
    return Error{fmt::format("table {}: columns differ from those of its first rows", more.table)};
  table.columns = more.columns;
  table.rows += more.values.size() / width;
  for (size_t i = 0; i < more.values.size(); i += width) {
    const Row row{table.columns, std::span(more.values).subspan(i, width)};
    if (&table == &frames_)
      add_frame(viewer_of(viewer), row);
    else if (&table == &updates_)
      add_update(viewer_of(viewer), row);
    else
      add_stages(row);
  }
  return ok_status();
}

void Measured::add_frame(ViewerFigures& viewer, const Row& row) {
  if (const auto t_s = row.of("t_s")) {
    add_lost(viewer, row);
    ++frames_shown;
    ++viewer.frames;
    viewer.frames_of_views += row.of("request").value_or(0) > 0;
    // A viewer that was started again counts its time anew.
    if (viewer.last_s > -1e300 && *t_s > viewer.last_s) viewer.duration_s += *t_s - viewer.last_s;
    viewer.last_s = *t_s;
  }
  add_delay(viewer, row);
  row.add_to(points_drawn, "points_drawn");
  row.add_to(update_age_ms, "update_age_ms");
  if (const auto lead_ms = row.of("lead_ms")) {
    headset = headset || *lead_ms != 0;
    frames_late += *lead_ms < 0;
  }
  refreshed = refreshed || row.of("refresh_ms").value_or(0) > 0;
  refreshes_missed += row.of("missed").value_or(0);
  add_coupling(viewer, row);
  add_skew(row);
}

// Viewers number their frames: where numbers are missing the rows were lost on the way. A viewer that was started again
// begins at a lower one.
void Measured::add_lost(ViewerFigures& viewer, const Row& row) {
  const auto frame = row.of("frame");
  if (!frame) return;
  const double before = std::exchange(viewer.last_frame, *frame);
  if (before < 0 || !(*frame > before + 1) || *frame - before > kMostLost) return;
  const auto lost = uint64_t(*frame - before) - 1;
  viewer.rows_lost += lost;
  viewer.frames += lost;
  frames_shown += lost;
  frame_rows_lost += lost;
}

// Of a still frame nothing was drawn: how long it took says nothing.
void Measured::add_delay(ViewerFigures& viewer, const Row& row) {
  const double ms = row.of("inter_frame_ms").value_or(0);  // 0: a viewer's first frame has none
  if (row.of("still").value_or(0) > 0) {
    ++frames_still;
    ++viewer.still;
    viewer.still_s += ms / 1e3;
    viewer.last_ms = 0;
    return;
  }
  row.add_to(construction_ms, "construction_ms");
  if (const auto seen_ms = row.of("motion_to_photon_ms"); seen_ms && *seen_ms >= 0) {
    motion_to_photon_ms.add(*seen_ms);
    viewer.motion_to_photon_ms.add(*seen_ms);
  }
  const double before_ms = std::exchange(viewer.last_ms, ms);
  if (!(ms > 0)) return;
  inter_frame_ms.add(ms);
  viewer.inter_frame_ms.add(ms);
  if (!(before_ms > 0)) return;
  jitter_sum_ms += std::abs(ms - before_ms);
  ++jitters;
}

void Measured::add_coupling(ViewerFigures& viewer, const Row& row) {
  const auto mode = row.of("coupling"), buffers = row.of("buffers");
  if (!mode || !buffers) return;
  coupled = true;
  const std::string name = coupling_name(*mode, *buffers);
  const auto known = std::find_if(frames_by_coupling.begin(), frames_by_coupling.end(),
                                  [&](const auto& c) { return c.first == name; });
  if (known != frames_by_coupling.end())
    ++known->second;
  else if (frames_by_coupling.size() < kMostCouplings)
    frames_by_coupling.emplace_back(name, 1);
  coupling_changes += !viewer.coupling.empty() && viewer.coupling != name;
  viewer.coupling = name;
}

// Each of a wall's frames counts once, whoever told of it.
void Measured::add_skew(const Row& row) {
  const auto number = row.of("wall_frame"), skew = row.of("swap_skew_ms");
  if (!number || !skew || !(*number > 0) || !(*skew >= 0)) return;
  if (*number + 2 * kMostOpenSkews < closed_skew_) close_skews();  // another wall, or another master's
  if (*number <= closed_skew_) return;
  open_skews_[*number] = *skew;
  if (open_skews_.size() <= kMostOpenSkews) return;
  closed_skew_ = open_skews_.begin()->first;
  skews_.add(open_skews_.begin()->second);
  open_skews_.erase(open_skews_.begin());
}

void Measured::close_skews() {
  skews_ = swap_skew_ms();
  open_skews_.clear();
  closed_skew_ = 0;
}

void Measured::begin_life() {
  close_skews();
  tiles_.begin_life();
}

Quantiles Measured::swap_skew_ms() const {
  Quantiles out = skews_;
  for (const auto& [frame, ms] : open_skews_) out.add(ms);
  return out;
}

void Measured::add_update(ViewerFigures& viewer, const Row& row) {
  row.add_to(start_up_ms, "start_up_ms");
  points_received += row.of("points").value_or(0);
  extra_points += row.of("extra_points").value_or(0);
  const auto ms = row.of("latency_ms");
  if (!ms || row.of("left_out").value_or(0) != 0) return;
  ++viewer.updates;
  latency_ms.add(*ms);
  viewer.latency_ms.add(*ms);
}

void Measured::add_stages(const Row& row) {
  if (const auto ms = row.of("latency_ms")) stages_latency_ms += *ms;
  for (const auto& stage : kStageColumns) row.add_to(stages_ms[stage.name], stage.name);
  if (const auto ms = row.of("display_ms"); ms && *ms >= 0) display_ms.add(*ms);  // else no frame showed it
}

}  // namespace telesplat::metrics
