#include "tools/telesplat/report/parts.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/common/json_file.h"
#include "tools/telesplat/report/reading/thinning.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

// Returns the value at "a.b.c", or null.
ordered_json at(const ordered_json& s, std::string_view path) {
  const ordered_json* here = &s;
  while (!path.empty()) {
    const size_t dot = std::min(path.find('.'), path.size());
    if (!here->is_object()) return nullptr;
    const auto found = here->find(std::string(path.substr(0, dot)));
    if (found == here->end()) return nullptr;
    here = &*found;
    path.remove_prefix(std::min(path.size(), dot + 1));
  }
  return *here;
}

std::string text_at(const ordered_json& s, const char* path) {
  const auto v = at(s, path);
  if (v.is_string()) return v.get<std::string>();
  if (v.is_number_integer()) return fmt::format("{}", v.get<int64_t>());
  if (v.is_number()) return fmt::format("{:g}", v.get<double>());
  return {};
}

std::string size(const ordered_json& s, const char* key) {
  const auto v = at(s, key);
  if (!v.is_array() || v.size() != 2 || !v[0].is_number_integer() || !v[1].is_number_integer()) return {};
  return fmt::format("{} x {}", v[0].get<int64_t>(), v[1].get<int64_t>());
}

// Joins a and b with `between`; if one is empty, returns the other.
std::string with(const std::string& a, const char* between, const std::string& b) {
  return a.empty() || b.empty() ? a : a + between + b;
}

std::string primitives(const ordered_json& s) {
  const std::string kind = text_at(s, "kind"), n = text_at(s, "primitives");
  if (n.empty()) return kind;
  return fmt::format("{} of {} {}", kind, n, kind == "mesh" ? "triangles" : kind == "volume" ? "voxels" : "primitives");
}

std::string machines(const ordered_json& s) {
  std::string out;
  const auto all = at(s, "machines");
  if (!all.is_array()) return out;
  for (const auto& m : all)
    out += fmt::format("{}{}: {}, {} cores{}{}", out.empty() ? "" : "; ", text_at(m, "host"), text_at(m, "processor"),
                       text_at(m, "cores"), text_at(m, "gpu").empty() ? "" : ", ", text_at(m, "gpu"));
  return out;
}

/// A figure: its key, where it lies in the summary, how it is shown, what it means. better: 1 more, -1 less, 0 neither.
/// table: "tile", "measure" (the thesis's seven), "more".
struct Measure {
  const char *key, *path, *label, *unit, *meaning;
  double scale;
  int better;
  const char* table;
  const char* fallback = "";  ///< the place in spreads, for runs without a summary
};

constexpr Measure kFigures[] = {
    {"m2p_median", "motion_to_photon_ms.median", "motion to photon, median", "ms",
     "from the moment a pose was taken to the frame that shows it", 1, -1, "tile", "motion_to_photon_ms.median"},
    {"m2p_p95", "motion_to_photon_ms.p95", "motion to photon, p95", "ms", "95 of 100 frames are faster", 1, -1, "tile",
     "motion_to_photon_ms.p95"},
    {"fps", "fps", "frames a second", "1/s", "drawn frames / the time that they took, mean over the viewers", 1, 1,
     "tile"},
    {"delay_median", "inter_frame_delay_ms.median", "inter-frame delay, median", "ms",
     "end of a frame minus end of the one before", 1, -1, "tile", "inter_frame_ms.median"},
    {"delay_p95", "inter_frame_delay_ms.p95", "inter-frame delay, p95", "ms", "95 of 100 frames are faster", 1, -1,
     "tile", "inter_frame_ms.p95"},
    {"delay_p99", "inter_frame_delay_ms.p99", "inter-frame delay, p99", "ms", "99 of 100 frames are faster", 1, -1,
     "tile", "inter_frame_ms.p99"},
    {"latency_median", "view_update_latency_ms.median", "view update latency, median", "ms",
     "from the request to the complete update in the viewer", 1, -1, "tile", "latency_ms.median"},
    {"latency_p95", "view_update_latency_ms.p95", "view update latency, p95", "ms", "95 of 100 updates are faster", 1,
     -1, "tile", "latency_ms.p95"},
    {"updates_per_s", "updates_per_s", "view updates a second", "1/s", "complete view updates / duration", 1, 1,
     "tile"},
    {"transfer", "data_transfer_rate_mb_s", "sent to viewers", "MB/s", "published patches / duration", 1, -1, "tile"},
    {"points_cached", "points_cached", "points cached", "M", "points of the model at the end", 1e-6, 0, "tile"},
    {"psnr", "quality.psnr_db.median", "PSNR, median", "dB", "of verified frames, against direct rendering", 1, 1,
     "tile"},
    {"holes", "quality.hole_fraction.median", "holes, median", "%", "pixels that show no data, but should", 100, -1,
     "tile"},

    {"generating", "data_generating_rate_mb_s", "data generating rate", "MB/s",
     "what samplers make, uncompressed, a second", 1, 0, "measure"},
    {"transfer_rate", "data_transfer_rate_mb_s", "data transfer rate", "MB/s",
     "encoded patches that were published, a second", 1, 0, "measure"},
    {"consuming", "data_consuming_rate_mb_s", "data consuming rate", "MB/s",
     "what a viewer inserts into its model, a second", 1, 0, "measure"},
    {"start_up_median", "start_up_latency_ms.median", "start-up latency", "ms",
     "from a request to the first data of its update in the viewer", 1, -1, "measure", "start_up_ms.median"},
    {"latency_measure", "view_update_latency_ms.median", "view update latency", "ms",
     "from a request to the complete update in the viewer", 1, -1, "measure", "latency_ms.median"},
    {"construction_median", "view_construction_ms.median", "view construction time", "ms",
     "choosing, drawing and shading a frame", 1, -1, "measure", "construction_ms.median"},
    {"delay_mean", "inter_frame_delay_ms.mean", "inter-frame delay", "ms",
     "average time between frames, the reciprocal of the frame rate", 1, -1, "measure", "inter_frame_ms.mean"},

    {"frames", "frames", "frames displayed", "", "", 1, 0, "more", "inter_frame_ms.n"},
    {"still", "frames_still", "of these, frames of a picture that stood", "", "nothing was drawn for them", 1, 0,
     "more"},
    {"missed", "refreshes_missed", "refreshes missed", "", "refreshes of the display without a new picture", 1, -1,
     "more"},
    {"m2p_max", "motion_to_photon_ms.max", "motion to photon, longest", "ms", "", 1, -1, "more",
     "motion_to_photon_ms.max"},
    {"m2p_sd", "motion_to_photon_ms.sd", "motion to photon, standard deviation", "ms", "", 1, -1, "more",
     "motion_to_photon_ms.sd"},
    {"delay_sd", "inter_frame_delay_ms.sd", "inter-frame delay, standard deviation", "ms", "", 1, -1, "more",
     "inter_frame_ms.sd"},
    {"jitter", "inter_frame_jitter_ms", "inter-frame delay, jitter", "ms",
     "mean difference of two delays that follow each other", 1, -1, "more"},
    {"latency_sd", "view_update_latency_ms.sd", "view update latency, standard deviation", "ms", "", 1, -1, "more",
     "latency_ms.sd"},
    {"updates", "updates", "view updates", "", "", 1, 0, "more", "latency_ms.n"},
    {"duration", "duration_s", "duration", "s", "from the first frame to the last", 1, 0, "more"},
    {"delay_max", "inter_frame_delay_ms.max", "inter-frame delay, longest", "ms", "", 1, -1, "more",
     "inter_frame_ms.max"},
    {"latency_max", "view_update_latency_ms.max", "view update latency, longest", "ms", "", 1, -1, "more",
     "latency_ms.max"},
    {"age_median", "update_age_ms.median", "update age, median", "ms",
     "end of a frame minus the request of the newest update in it", 1, -1, "more", "update_age_ms.median"},
    {"age_p95", "update_age_ms.p95", "update age, p95", "ms", "", 1, -1, "more", "update_age_ms.p95"},
    {"first_points", "first_points_s", "first points on display after", "s", "from the session's start", 1, -1, "more"},
    {"sampling", "sampling_ms.median", "sampling of a view, median", "ms", "", 1, -1, "more"},
    {"packing", "packing_ms.median", "packing of a view, median", "ms", "", 1, -1, "more"},
    {"sent", "bytes_sent", "sent to viewers in all", "MB", "", 1e-6, -1, "more"},
    {"compression", "compression_ratio", "elimination and coding", ": 1", "raw samples / what was sent", 1, 1, "more"},
    {"eliminated", "redundancy_eliminated", "redundant samples eliminated", "%", "", 100, 0, "more"},
    {"rays_saved", "rays_saved", "rays saved by steering", "%", "", 100, 1, "more"},
    {"ssim", "quality.ssim.median", "SSIM, median", "", "", 1, 1, "more"},
    {"flip", "quality.flip.median", "FLIP, median", "", "", 1, -1, "more"},
    {"holes_p95", "quality.hole_fraction.p95", "holes, p95", "%", "", 100, -1, "more"},
    {"flicker", "quality.flicker.median", "flicker, median", "of 255", "", 1, -1, "more"},
    {"rejected", "errors.messages_rejected", "messages rejected", "", "malformed, oversized or unexpected", 1, -1,
     "error"},
    {"gaps", "errors.gaps_resynced", "gaps resynchronised", "", "a viewer missed events and was brought up to date", 1,
     -1, "error"},
    {"expired", "errors.leases_expired", "leases expired", "", "ran out, or their sampler died", 1, -1, "error"},
};

// Adds rates from the tables, for a run without a summary.
void add_counted(const ordered_json& spreads, const RunTables& t, ordered_json& out) {
  const double s = t.duration_s();
  if (!(s > 0)) return;
  out["duration"] = rounded(s);
  if (const auto n = at(spreads, "inter_frame_ms.n"); n.is_number() && s > t.still_s())
    out["fps"] = rounded(n.get<double>() / (s - t.still_s()));
  if (const auto n = at(spreads, "latency_ms.n"); n.is_number()) out["updates_per_s"] = rounded(n.get<double>() / s);
}

}  // namespace

ordered_json read_summary(const std::string& directory) {
  if (!lies_within(directory, "summary.json")) return {};
  auto out = tools::read_json_file(directory + "/summary.json");
  return out.is_object() ? out : ordered_json();
}

ordered_json facts_json(const ordered_json& s) {
  ordered_json out = ordered_json::array();
  const auto add = [&](const char* what, const std::string& how) {
    if (!how.empty()) out.push_back({what, how});
  };
  if (!s.is_object()) return out;
  add("scene", text_at(s, "scene"));
  add("kind", primitives(s));
  add("display", size(s, "size"));
  add("sampled", with(size(s, "sampling_size"), ", ", text_at(s, "sampling")));
  add("samplers", text_at(s, "samplers"));
  add("viewers", text_at(s, "viewers"));
  const std::string coupling = text_at(s, "coupling");
  add("coupling", coupling == "loose" ? with(coupling, ", buffers: ", text_at(s, "buffers")) : coupling);
  const std::string gl_ms = text_at(s, "renderer_ms.gl");
  add("renderer", with(text_at(s, "renderer"), ", a frame in ms: OpenGL ",
                       gl_ms.empty() ? gl_ms : gl_ms + ", processor " + text_at(s, "renderer_ms.cpu")));
  add("splats", with(text_at(s, "splat"), ", finish ", text_at(s, "finish")));
  add("shading", text_at(s, "shading"));
  add("walk", with(text_at(s, "trajectory.name"), ", ", text_at(s, "trajectory.file")));
  add("version", text_at(s, "version"));
  add("began", text_at(s, "begin").substr(0, 19));
  add("machines", machines(s));
  add("data", text_at(s, "data.file"));
  for (const ordered_json& remark : at(s, "data.remarks"))
    if (remark.is_string()) add("remark", remark.get<std::string>());
  const auto command = at(s, "command");
  add("command", command.is_string() ? command.get<std::string>() : std::string());
  return out;
}

ordered_json figure_kinds() {
  ordered_json out = ordered_json::array();
  for (const Measure& f : kFigures)
    out.push_back({{"key", f.key},
                   {"path", f.path},
                   {"scale", f.scale},
                   {"label", f.label},
                   {"unit", f.unit},
                   {"meaning", f.meaning},
                   {"better", f.better},
                   {"table", f.table}});
  return out;
}

ordered_json figures_json(const ordered_json& summary, const ordered_json& spreads, const RunTables& tables) {
  ordered_json out = ordered_json::object();
  if (!summary.is_object()) add_counted(spreads, tables, out);
  for (const Measure& f : kFigures) {
    ordered_json v = at(summary, f.path);
    if (!summary.is_object() && *f.fallback) v = at(spreads, f.fallback);
    if (v.is_number() && std::isfinite(v.get<double>())) out[f.key] = rounded(v.get<double>() * f.scale, 6);
  }
  return out;
}

}  // namespace telesplat::launcher
