#include "services/master/record/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/image/depth_image.h"
#include "common/metrics/stages.h"
#include "common/metrics/statistics.h"
#include "common/scene/session.h"
#include "services/master/record/about.h"

namespace telesplat::metrics {
namespace {

using nlohmann::ordered_json;

constexpr double kRawBytesPerSlicePixel = 4, kRawBytesPerPoint = 12;

double hundredths(double v) { return std::round(v * 100) / 100; }
double thousandths(double v) { return std::round(v * 1000) / 1000; }
/// Returns a number as a whole one from 0 to 2^53: peers may send any number.
uint64_t whole(double v) {
  constexpr double kMostWhole = 9007199254740992;  // 2^53
  return v > 0 ? uint64_t(std::min(v, kMostWhole)) : 0;
}

ordered_json or_null(const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); }
/// Returns the rows by file; null: there are no rows.
ordered_json rows_of(const std::map<std::string, uint64_t>& rows) {
  return rows.empty() ? ordered_json() : ordered_json(rows);
}
/// Rows that no file took, and rows of frames that never came.
std::map<std::string, uint64_t> lost_rows(const Measured& measured, const RecordLosses& losses) {
  auto out = losses.lost;
  if (const auto lost = measured.frame_sums.rows_lost; lost > 0) out["frames.csv"] += lost;
  return out;
}
/// Returns a figure that has a meaning only if `measured`; else null.
template <class V>
ordered_json if_measured(bool measured, V value) {
  return measured ? ordered_json(value) : ordered_json();
}

/// Returns a rate; null with fewer than two frames.
ordered_json rate(const ViewerFigures& v, uint64_t count) {
  return if_measured(v.duration_s > 0, hundredths(v.per_second(count)));
}

/// Data that samplers made, data that was sent, and data that viewers took.
struct Traffic {
  double bytes_raw = 0, bytes_sent = 0, bytes_consumed = 0;
  double redundancy = 0;   ///< share of the samples that elimination left out
  bool sampled = false;    ///< true if there were samples
  bool eliminates = true;  ///< true for points; nothing is eliminated from slice images
};

bool has_slices(const std::string& kind_name) {
  const auto kind = scene::kind_named(kind_name);
  return kind && scene::pipeline_of(*kind) == scene::Pipeline::kSlices;
}

/// points: number that viewers inserted.
Traffic traffic(const Measured& m, bool slices, double points) {
  Traffic out;
  const double samples = m.tiles().samples(), kept = m.tiles().kept();
  out.bytes_sent = m.tiles().bytes_sent();
  out.sampled = samples > 0;
  out.bytes_consumed = points * kRawBytesPerPoint;
  if (slices) {
    // `samples` counts voxels, and `kept` the pixels that they made.
    out.eliminates = false;
    out.bytes_raw = kept * kRawBytesPerSlicePixel;
    out.bytes_consumed += m.update_sums.points_received * kRawBytesPerSlicePixel;
  } else {
    out.bytes_raw = samples * image::kRawBytesPerPixel;
    out.redundancy = samples > 0 ? 1 - kept / samples : 0;
  }
  return out;
}

/// Returns how evenly samplers were kept busy: (most - least) / mean.
ordered_json busy_spread(const std::map<std::string, double>& busy_s) {
  double least = 1e300, most = 0, sum = 0;
  auto by_name = ordered_json::object();
  for (const auto& [name, s] : busy_s) {
    least = std::min(least, s);
    most = std::max(most, s);
    sum += s;
    by_name[name] = std::round(s * 1e6) / 1e6;
  }
  const double spread = sum > 0 ? (most - least) * double(busy_s.size()) / sum : 0;
  return {{"spread", if_measured(sum > 0, std::round(spread * 1e4) / 1e4)}, {"busy_s", by_name}};
}

/// Returns one number for roles with one process, a list for roles that may have several.
ordered_json peak_rss(const Roster& roster) {
  const auto tenths = [](double v) { return std::round(v * 10) / 10; };
  ordered_json out = ordered_json::object();
  for (const char* role : {"master", "data", "packer"})
    for (const double mb : roster.each(role, "peak_rss_mb")) out[role] = tenths(mb);
  for (const char* role : {"sampler", "viewer"}) {
    out[role] = ordered_json::array();
    for (const double mb : roster.each(role, "peak_rss_mb")) out[role].push_back(tenths(mb));
  }
  return out;
}

// ---- the sections of the summary, in its order ---------------------------------------------------------------------

/// Returns the simulated links, by the process before which they lie.
ordered_json links_of(const std::vector<Process>& processes) {
  auto out = ordered_json::object();
  for (const Process& p : processes)
    if (const std::string link = scene::value_or(p.facts, "link", std::string()); !link.empty()) out[p.name] = link;
  return out.empty() ? ordered_json() : out;
}

/// "auto" becomes the renderer that a viewer kept after it timed both.
ordered_json renderer_of(const Roster& roster) {
  const auto kept = roster.each("viewer", "renderer_gl");
  const std::string told = roster.fact("viewer", "renderer");
  if (told != "auto" || kept.empty()) return or_null(told);
  return kept.front() > 0 ? "gl" : "cpu";
}

/// Returns the median milliseconds a frame of both, by which it was chosen; null: there was no choice.
ordered_json renderer_times(const Roster& roster) {
  const auto cpu = roster.each("viewer", "renderer_cpu_ms"), gl = roster.each("viewer", "renderer_gl_ms");
  if (cpu.empty() || gl.empty()) return nullptr;
  return {{"cpu", hundredths(cpu.front())}, {"gl", hundredths(gl.front())}};
}

ordered_json what_was_shown(const std::vector<Process>& processes, const Roster& roster) {
  const auto viewer = [&](const char* key) { return or_null(roster.fact("viewer", key)); };
  const auto size = [&](const char* width, const char* height) -> ordered_json {
    if (roster.number("viewer", width) <= 0) return nullptr;
    return {whole(roster.number("viewer", width)), whole(roster.number("viewer", height))};
  };
  // Data servers of earlier versions sent triangles or voxels.
  double primitives = roster.number("data", "primitives");
  if (primitives == 0) primitives = roster.number("data", "triangles") + roster.number("data", "voxels");
  return {{"scene", or_null(roster.fact("data", "scene"))},
          {"kind", or_null(roster.fact("data", "kind"))},
          {"primitives", if_measured(primitives > 0, whole(primitives))},
          {"samplers", roster.count("sampler")},
          {"viewers", roster.count("viewer")},
          {"coupling", viewer("coupling")},
          {"buffers", if_measured(!viewer("buffers").is_null(), whole(roster.number("viewer", "buffers")))},
          {"renderer", renderer_of(roster)},
          {"renderer_ms", renderer_times(roster)},
          {"splat", viewer("splat")},
          {"finish", viewer("finish")},
          {"shading", viewer("shading")},
          {"stereo", viewer("stereo")},
          {"size", size("width", "height")},
          {"sampling_size", size("sampling_width", "sampling_height")},
          {"sampling", viewer("sampling")},
          {"links", links_of(processes)}};
}

/// Returns each stage's distribution of time in view updates, and its share of the sum of all latencies.
ordered_json where_time_went(const StageSums& stages) {
  const double sum = stages.latency_ms;
  auto out = ordered_json::object();
  for (const std::string& column : names(kStageColumns)) {
    const auto ms = stages.ms.find(column);
    if (ms == stages.ms.end() || ms->second.empty()) continue;
    ordered_json& entry = out[column.substr(0, column.rfind("_ms"))];
    entry = distribution_json(ms->second);
    entry["share"] = sum > 0 ? std::round(ms->second.sum() / sum * 1e4) / 1e4 : 0.0;
  }
  return if_measured(!out.empty(), out);
}

/// Returns how well the processes' clocks are known: the largest offset and error of all.
ordered_json clocks(const std::vector<Process>& processes) {
  double offset_ms = 0, error_ms = -1;
  for (const Process& p : processes) {
    const auto error = p.values.find("clock_error_ms"), offset = p.values.find("clock_offset_ms");
    if (error == p.values.end() || offset == p.values.end()) continue;
    error_ms = std::max(error_ms, error->second);
    if (std::abs(offset->second) > std::abs(offset_ms)) offset_ms = offset->second;
  }
  return if_measured(error_ms >= 0, ordered_json{{"largest_offset_ms", thousandths(offset_ms)},
                                                 {"largest_error_ms", thousandths(error_ms)}});
}

double longest_s(const std::map<std::string, ViewerFigures>& viewers) {
  double out = 0;
  for (const auto& [name, v] : viewers) out = std::max(out, v.duration_s);
  return out;
}

ordered_json how_often(const Measured& m, const std::map<std::string, ViewerFigures>& viewers,
                       double frames_completed) {
  auto each = ordered_json::object();
  double fps = 0, updates_per_s = 0;
  const auto drew = std::count_if(viewers.begin(), viewers.end(), [](const auto& v) { return v.second.fps() > 0; });
  for (const auto& [name, v] : viewers) {
    if (v.fps() > 0) fps += v.fps() / double(drew);
    updates_per_s += v.per_second(v.updates) / double(viewers.size());
    each[name] = {{"frames", v.frames},
                  {"frames_of_views", v.frames_of_views},
                  {"updates", v.updates},
                  {"duration_s", thousandths(v.duration_s)},
                  {"frames_still", v.still},
                  {"fps", if_measured(v.fps() > 0, hundredths(v.fps()))},
                  {"updates_per_s", rate(v, v.updates)},
                  {"motion_to_photon_ms", distribution_json(v.motion_to_photon_ms)},
                  {"inter_frame_delay_ms", distribution_json(v.inter_frame_ms)},
                  {"view_update_latency_ms", distribution_json(v.latency_ms)}};
  }
  return {{"epochs", m.epochs()},
          {"frames", m.frame_sums.shown},
          {"frames_still", m.frame_sums.still},
          {"updates", m.update_sums.latency_ms.count()},
          {"duration_s", if_measured(longest_s(viewers) > 0, thousandths(longest_s(viewers)))},
          {"fps", if_measured(fps > 0, hundredths(fps))},
          {"updates_per_s", if_measured(longest_s(viewers) > 0, hundredths(updates_per_s))},
          {"by_viewer", each},
          {"frames_sampled", whole(frames_completed)}};
}

ordered_json how_coupled(const Couplings& c) {
  if (!c.known) return {{"coupling_changes", nullptr}, {"frames_by_coupling", nullptr}};
  auto frames = ordered_json::object();
  for (const auto& [name, count] : c.frames) frames[name] = count;
  return {{"coupling_changes", c.changes}, {"frames_by_coupling", frames}};
}

/// Reports how well the displays of a wall kept in step.
ordered_json how_together(const Measured& m, double incomplete) {
  const Quantiles ms = m.wall_skews.ms();
  return {{"swap_skew_ms", distribution_json(ms)},
          {"swaps", if_measured(!ms.empty(), ms.count())},
          {"swaps_incomplete", if_measured(!ms.empty(), whole(incomplete))}};
}

ordered_json how_long(const Measured& m) {
  const FrameSums& f = m.frame_sums;
  const FrameDurations durations = m.tiles().durations();
  return {{"motion_to_photon_ms", distribution_json(f.motion_to_photon_ms)},
          {"inter_frame_delay_ms", distribution_json(f.inter_frame_ms)},
          {"inter_frame_jitter_ms", if_measured(f.jitters > 0, thousandths(f.jitter_sum_ms / double(f.jitters)))},
          {"view_construction_ms", distribution_json(f.construction_ms)},
          {"view_update_latency_ms", distribution_json(m.update_sums.latency_ms)},
          {"start_up_latency_ms", distribution_json(m.update_sums.start_up_ms)},
          {"latency_stages_ms", where_time_went(m.stage_sums)},
          {"display_latency_ms",
           distribution_json(m.stage_sums.display_ms)},  // completion to the end of the first frame with it
          {"sampling_ms", distribution_json(durations.sampling_ms)},
          {"lease_to_sampled_ms", distribution_json(durations.leased_ms)},
          {"packing_ms", distribution_json(durations.packing_ms)},
          {"samplers_busy", busy_spread(m.tiles().busy_s())}};
}

ordered_json how_much(const Traffic& t, double run_s, double viewers) {
  const bool lasted = t.sampled && run_s > 0;
  return {{"data_generating_rate_mb_s", if_measured(lasted, t.bytes_raw / 1e6 / run_s)},
          {"data_transfer_rate_mb_s", if_measured(lasted, t.bytes_sent / 1e6 / run_s)},
          {"data_consuming_rate_mb_s", if_measured(lasted, t.bytes_consumed / 1e6 / viewers / run_s)},
          {"bytes_raw", if_measured(t.sampled, whole(t.bytes_raw))},
          {"bytes_sent", if_measured(t.sampled, whole(t.bytes_sent))},
          {"compression_ratio", if_measured(t.bytes_sent > 0, t.bytes_raw / t.bytes_sent)},
          {"redundancy_eliminated", if_measured(t.sampled && t.eliminates, t.redundancy)}};
}

/// Returns the largest errors with which points were published, and how much was made exact later.
ordered_json how_exact(const TileSums& t, const Roster& roster) {
  const bool any = t.bounded() > 0;
  return {{"errors_allowed",
           if_measured(any, ordered_json{{"tiles", t.bounded()},
                                         {"depth_m", t.depth_error_m()},
                                         {"normal_deg", t.normal_error_deg()},
                                         {"colour", t.colour_error()},
                                         {"patches", whole(roster.counted("packer", "patches_bounded"))},
                                         {"patches_refined", whole(roster.counted("packer", "patches_refined"))},
                                         {"bytes_refined", whole(roster.counted("packer", "bytes_refined"))}})}};
}

/// Returns the rays that steering saved: rays of all tiles, against those of whole views.
ordered_json what_was_steered(const TileSums& t) {
  return {{"rays_cast", if_measured(t.rays_full() > 0, whole(t.rays_cast()))},
          {"rays_full", if_measured(t.rays_full() > 0, whole(t.rays_full()))},
          {"rays_saved", if_measured(t.rays_full() > 0, 1 - t.rays_cast() / t.rays_full())},
          {"plans", if_measured(t.plans() > 0, t.plans())},
          {"plans_late", if_measured(t.plans() > 0, t.plans_late())},
          {"plan_ms", distribution_json(t.plan_ms())},
          {"plan_answer_ms", distribution_json(t.plan_answer_ms())}};
}

ordered_json what_was_held(const Measured& m, const Roster& roster, double partitions, double viewers) {
  const double points = roster.present("packer", "points"), voxels = roster.counted("data", "voxels_sent"),
               first_points_s = roster.present("viewer", "first_points_s");
  return {{"points_cached", if_measured(!roster.each("packer", "points").empty(), whole(points))},
          {"bytes_per_cached_point", if_measured(points > 0, roster.present("packer", "model_bytes") / points)},
          {"points_drawn", distribution_json(m.frame_sums.points_drawn)},
          {"update_age_ms", distribution_json(m.frame_sums.update_age_ms)},
          {"voxels_fetched", if_measured(!roster.each("data", "voxels_sent").empty(), whole(voxels))},
          {"bytes_per_voxel", if_measured(voxels > 0, roster.counted("data", "bytes_sent") / voxels)},
          {"partitions", if_measured(partitions > 0, whole(partitions))},
          {"first_points_s", if_measured(first_points_s > 0, first_points_s / viewers)}};
}

/// Returns mean errors of all viewers' predictions, weighted by their numbers; null: no prediction could be judged.
ordered_json predicted(const Roster& roster, const std::string& what) {
  const auto counts = roster.each("viewer", what + "s");
  const double count = std::accumulate(counts.begin(), counts.end(), 0.0);
  if (!(count > 0)) return nullptr;
  const auto mean = [&](const char* figure) {
    const auto each = roster.each("viewer", what + figure);
    double sum = 0;
    for (size_t i = 0; i < std::min(each.size(), counts.size()); ++i) sum += each[i] * counts[i];
    return sum / count;
  };
  const double mm = mean("_error_mm"), deg = mean("_error_deg"), none_mm = mean("_none_mm"),
               none_deg = mean("_none_deg");
  return {{"count", whole(count)},
          {"horizon_ms", thousandths(mean("_horizon_ms"))},
          {"error_mm", thousandths(mm)},
          {"error_deg", thousandths(deg)},
          {"none_mm", thousandths(none_mm)},
          {"none_deg", thousandths(none_deg)},
          {"over_none_mm", if_measured(none_mm > 0, thousandths(mm / none_mm))},
          {"over_none_deg", if_measured(none_deg > 0, thousandths(deg / none_deg))}};
}

ordered_json how_in_time(const FrameSums& f) {
  return {{"frames_late", if_measured(f.headset, f.late)},
          {"refreshes_missed", if_measured(f.headset || f.refreshed, whole(f.refreshes_missed))}};
}

ordered_json how_heads_moved(const Roster& roster) {
  return {{"predicted_by", or_null(roster.fact("viewer", "prediction"))},
          {"prediction", predicted(roster, "prediction")},
          {"pose_prediction", predicted(roster, "pose_prediction")}};
}

}  // namespace

ordered_json summarise(const Measured& measured, const std::vector<Process>& processes,
                       const std::map<std::string, double>& counters, const About& about) {
  const Roster roster(processes);
  const auto counter = [&](const char* key) { return scene::value_or(counters, key, 0.0); };
  const auto& figures = measured.viewers();
  const double viewers = std::max<double>(1, double(roster.count("viewer")));
  const double run_s = longest_s(figures);
  ordered_json out{{"schema", 2}, {"lives", about.lives}};
  out.update(what_was_done(about, processes));
  out.update(what_was_shown(processes, roster));
  out.update(how_often(measured, figures, counter("frames_completed")));
  out.update(how_coupled(measured.couplings));
  out.update(how_long(measured));
  out.update(how_together(measured, counter("swaps_incomplete")));
  out.update(how_in_time(measured.frame_sums));
  out.update(how_heads_moved(roster));
  out["clock"] = clocks(processes);
  out.update(
      how_much(traffic(measured, has_slices(roster.fact("data", "kind")), roster.counted("viewer", "points_received")),
               run_s, viewers));
  out.update(how_exact(measured.tiles(), roster));
  out.update(what_was_steered(measured.tiles()));
  out.update(what_was_held(measured, roster, counter("partitions"), viewers));
  out.update(ordered_json{
      {"tiles_released", whole(counter("tiles_released"))},
      {"leases_backup", whole(counter("leases_backup"))},
      {"views_overtaken", whole(counter("views_overtaken"))},
      {"limits",
       {{"views_coarser", whole(counter("limits.views_coarser"))},
        {"hellos_refused", whole(counter("limits.hellos_refused"))},
        {"messages_refused", whole(counter("limits.messages_refused") + roster.counted("", "messages_refused"))},
        {"connections_refused", whole(roster.counted("", "connections_refused"))},
        {"queue_refused", whole(roster.counted("", "queue_refused"))}}},
      {"quality", nullptr},
      {"peak_rss_mb", peak_rss(roster)},
      {"errors",
       {{"messages_rejected", whole(roster.counted("", "messages_rejected"))},
        {"keys_refused", whole(roster.counted("", "keys_refused"))},
        {"gaps_resynced", whole(roster.counted("viewer", "gaps_resynced"))},
        {"leases_expired", whole(counter("leases_expired"))},
        {"viewers_lost", roster.lost("viewer")},
        {"record_failed", about.losses.failed.size() + whole(roster.counted("", kRecordFailed))},
        {"record_lost", rows_of(lost_rows(measured, about.losses))},
        {"record_cut", rows_of(about.losses.cut)}}}});
  return out;
}

void measure_again(const Measured& m, ordered_json& summary) {
  const auto text = [&](const char* key) {
    return summary.contains(key) && summary[key].is_string() ? summary[key].get<std::string>() : std::string();
  };
  const bool slices = has_slices(text("kind"));
  ordered_json again = how_often(m, m.viewers(), 0);
  for (const ordered_json& part :
       {how_coupled(m.couplings), how_long(m), how_together(m, 0), how_in_time(m.frame_sums),
        what_was_steered(m.tiles()),
        how_much(traffic(m, slices, slices ? 0 : m.update_sums.points_received + m.update_sums.extra_points),
                 longest_s(m.viewers()), std::max<double>(1, double(m.viewers().size())))})
    again.update(part);
  again["points_drawn"] = distribution_json(m.frame_sums.points_drawn);
  again["update_age_ms"] = distribution_json(m.frame_sums.update_age_ms);
  for (const char* counted : {"frames_sampled", "swaps_incomplete"}) again.erase(counted);
  summary.update(again);
}

}  // namespace telesplat::metrics
