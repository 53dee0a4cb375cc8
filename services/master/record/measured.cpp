#include "services/master/record/measured.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <sstream>
#include <utility>

#include "common/metrics/stages.h"

namespace telesplat::metrics {

namespace {

constexpr double kError = 0.005;                              // relative error of a percentile
constexpr double kLeast = 1e-9, kGreatest = 1e15;             // smaller or larger sizes count as these
const double kWidth = std::log1p(2 * kError / (1 - kError));  // logarithmic width of a bucket

int bucket_of(double size) { return int(std::ceil(std::log(std::clamp(size, kLeast, kGreatest)) / kWidth)); }
// Returns the value that is within kError of all values of its bucket.
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

// ---- tiles ----------------------------------------------------------------------------------------------------------

namespace {

constexpr size_t kMostOpen = 256, kMostPlanned = 4096;  // frames

}  // namespace

void TileSums::add(const std::string& sampler, const wire::TileDone& tile) {
  samples_ += double(tile.samples);
  kept_ += double(tile.kept);
  bytes_sent_ += double(tile.bytes_sent);
  bounded_ += tile.depth_error_m > 0 || tile.normal_error_deg > 0 || tile.colour_error > 0;
  depth_error_m_ = std::max(depth_error_m_, tile.depth_error_m);
  normal_error_deg_ = std::max(normal_error_deg_, tile.normal_error_deg);
  colour_error_ = std::max(colour_error_, tile.colour_error);
  rays_cast_ += double(tile.rays);
  if (!planned_.contains(tile.frame.value)) rays_full_ += double(tile.rays);
  const bool room = busy_s_.size() < kMostSamplers || busy_s_.contains(sampler);
  busy_s_[room ? sampler : "others"] += std::max(0.0, tile.moments.encode_end_s - tile.moments.sample_begin_s);
  if (tile.step == 1 && !tile.extra) time(tile);
}

void TileSums::time(const wire::TileDone& tile) {
  if (tile.frame.value <= closed_) return;
  Times& f = open_[tile.frame.value];
  const wire::Moments& at = tile.moments;
  f.leased = std::min(f.leased, at.leased_s);
  f.begin = std::min(f.begin, at.sample_begin_s);
  f.end = std::max(f.end, at.encode_end_s);
  f.packing_s += at.packed_s - at.receive_s;
  while (open_.size() > kMostOpen) {
    closed_ = open_.begin()->first;
    close(open_.begin()->second, durations_);
    open_.erase(open_.begin());
  }
}

void TileSums::close(const Times& f, FrameDurations& durations) {
  durations.leased_ms.add((f.end - f.leased) * 1e3);
  durations.sampling_ms.add((f.end - f.begin) * 1e3);
  durations.packing_ms.add(f.packing_s * 1e3);
}

FrameDurations TileSums::durations() const {
  FrameDurations out = durations_;
  for (const auto& [frame, times] : open_) close(times, out);
  return out;
}

void TileSums::add(const PlanRow& plan) {
  ++plans_;
  if (plan.outcome == PlanRow::Outcome::kLate)
    ++plans_late_;
  else if (!plan.asked.extra)
    plan_answer_ms_.add((plan.planned_s - plan.asked_s) * 1e3);
  if (const auto ms = plan.figures.find("plan_ms"); ms != plan.figures.end() && !plan.asked.extra)
    plan_ms_.add(ms->second);
  if (plan.outcome != PlanRow::Outcome::kTiles && plan.outcome != PlanRow::Outcome::kEmpty) return;
  rays_full_ += double(plan.rays_full());
  planned_.insert(plan.asked.frame.value);
  if (planned_.size() > kMostPlanned) planned_.erase(planned_.begin());
}

void TileSums::begin_life() {
  for (const auto& [frame, times] : open_) close(times, durations_);
  open_.clear();
  planned_.clear();
  closed_ = 0;
}

// ---- all ------------------------------------------------------------------------------------------------------------

namespace {

constexpr size_t kMostCouplings = 256, kMostOpenSkews = 1024;
constexpr double kMostLost = 1e6;  // frames in a row: after a larger step the viewer counts anew

std::string coupling_name(double mode, double buffers) {
  if (mode == 0) return "async";
  if (mode == 3) return "images";
  return mode == 1 ? "sync" : fmt::format("loose({:.0f})", buffers);
}

}  // namespace

/// A row of a table, whose values are found by the names of their columns.
struct MeasuredRow {
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
    const MeasuredRow row{table.columns, std::span(more.values).subspan(i, width)};
    if (&table == &frames_) {
      ViewerFigures& by = viewer_of(viewer);
      frame_sums.add(by, row);
      couplings.add(by, row);
      wall_skews.add(row);
    } else if (&table == &updates_) {
      update_sums.add(viewer_of(viewer), row);
    } else {
      stage_sums.add(row);
    }
  }
  return ok_status();
}

void FrameSums::add(ViewerFigures& viewer, const MeasuredRow& row) {
  if (const auto t_s = row.of("t_s")) {
    add_lost(viewer, row);
    ++shown;
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
    late += *lead_ms < 0;
  }
  refreshed = refreshed || row.of("refresh_ms").value_or(0) > 0;
  refreshes_missed += row.of("missed").value_or(0);
}

// Counts missing frame numbers as rows that were lost on the way. A restarted viewer begins at a lower number.
void FrameSums::add_lost(ViewerFigures& viewer, const MeasuredRow& row) {
  const auto frame = row.of("frame");
  if (!frame) return;
  const double before = std::exchange(viewer.last_frame, *frame);
  if (before < 0 || !(*frame > before + 1) || *frame - before > kMostLost) return;
  const auto lost = uint64_t(*frame - before) - 1;
  viewer.rows_lost += lost;
  viewer.frames += lost;
  shown += lost;
  rows_lost += lost;
}

// A still frame's delay does not count: nothing was drawn for it.
void FrameSums::add_delay(ViewerFigures& viewer, const MeasuredRow& row) {
  const double ms = row.of("inter_frame_ms").value_or(0);  // 0: a viewer's first frame has no delay
  if (row.of("still").value_or(0) > 0) {
    ++still;
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

void Couplings::add(ViewerFigures& viewer, const MeasuredRow& row) {
  const auto mode = row.of("coupling"), buffers = row.of("buffers");
  if (!mode || !buffers) return;
  known = true;
  const std::string name = coupling_name(*mode, *buffers);
  const auto of_it = std::find_if(frames.begin(), frames.end(), [&](const auto& c) { return c.first == name; });
  if (of_it != frames.end())
    ++of_it->second;
  else if (frames.size() < kMostCouplings)
    frames.emplace_back(name, 1);
  changes += !viewer.coupling.empty() && viewer.coupling != name;
  viewer.coupling = name;
}

void WallSkews::add(const MeasuredRow& row) {
  const auto number = row.of("wall_frame"), skew = row.of("swap_skew_ms");
  if (!number || !skew || !(*number > 0) || !(*skew >= 0)) return;
  if (*number + 2 * kMostOpenSkews < closed_) close();  // numbers of another wall, or of another master
  if (*number <= closed_) return;
  open_[*number] = *skew;
  if (open_.size() <= kMostOpenSkews) return;
  closed_ = open_.begin()->first;
  skews_.add(open_.begin()->second);
  open_.erase(open_.begin());
}

void WallSkews::close() {
  skews_ = ms();
  open_.clear();
  closed_ = 0;
}

Quantiles WallSkews::ms() const {
  Quantiles out = skews_;
  for (const auto& [frame, ms] : open_) out.add(ms);
  return out;
}

void Measured::begin_life() {
  wall_skews.close();
  tiles_.begin_life();
}

void UpdateSums::add(ViewerFigures& viewer, const MeasuredRow& row) {
  row.add_to(start_up_ms, "start_up_ms");
  points_received += row.of("points").value_or(0);
  extra_points += row.of("extra_points").value_or(0);
  const auto ms = row.of("latency_ms");
  if (!ms || row.of("left_out").value_or(0) != 0) return;
  ++viewer.updates;
  latency_ms.add(*ms);
  viewer.latency_ms.add(*ms);
}

void StageSums::add(const MeasuredRow& row) {
  if (const auto sum = row.of("latency_ms")) latency_ms += *sum;
  for (const auto& stage : kStageColumns) row.add_to(ms[stage.name], stage.name);
  if (const auto shown = row.of("display_ms"); shown && *shown >= 0)
    display_ms.add(*shown);  // below 0: no frame showed it
}

namespace {

using Names = std::vector<std::string>;

// Splits a text at its spaces.
Names split(const char* text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

const Names kFrames = split(
    "frame t_s inter_frame_ms construction_ms select_ms render_ms project_cpu_ms resolve_cpu_ms fill_cpu_ms "
    "smooth_cpu_ms antialias_cpu_ms points_selected points_drawn items points_cached sequence update_age_ms "
    "view_error_m view_error_deg px py pz qw qx qy qz present_ms detail budget_ms epoch wait_ms request "
    "buffers_filled summaries splat finish lit begin_s refined refine_ms sub_pixels coupling buffers head_light "
    "background wall_frame swap_wait_ms swap_skew_ms stereo screen_m left_x left_y left_z right_x right_y "
    "right_z lead_ms missed motion_to_photon_ms predicted_ms refresh_ms still halved");
const Names kUpdates = split(
    "request frame requested_s first_s complete_s latency_ms start_up_ms tiles samples points bytes eliminated "
    "sampling_width sampling_height epoch extra_points extra_bytes left_out");

// Columns of "stages" before and after those of the stages.
const Names kBeforeStages{"request", "frame", "tile", "requested_s", "complete_s"},
    kAfterStages{"latency_ms", "patches", "display_ms"};

Names stage_names() {
  Names out = kBeforeStages;
  for (const auto& stage : kStageColumns) out.push_back(stage.name);
  out.insert(out.end(), kAfterStages.begin(), kAfterStages.end());
  return out;
}

}  // namespace

const Names& viewer_columns(std::string_view table) {
  static const Names none, stages = stage_names();
  if (table == "frames") return kFrames;
  if (table == "updates") return kUpdates;
  return table == "stages" ? stages : none;
}

}  // namespace telesplat::metrics
