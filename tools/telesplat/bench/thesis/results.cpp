// What the steps left, as tables beside the thesis's own numbers.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>

#include "tools/common/csv_table.h"
#include "tools/common/json_file.h"
#include "tools/telesplat/bench/scaling_report.h"
#include "tools/telesplat/bench/thesis/report.h"
#include "tools/telesplat/bench/thesis/timeline.h"
#include "tools/telesplat/bench/volume_report.h"
#include "tools/telesplat/sweep/figures.h"

namespace telesplat::launcher {
namespace {

std::string number(const std::optional<double>& v, int decimals) {
  return v ? fmt::format("{:.{}f}", *v, decimals) : std::string("-");
}

// Numbers of a JSON file; none where it is not there.
Figures figures_of(const std::string& path) {
  const auto json = tools::read_json_file(path);
  return json.is_object() ? flatten(json) : Figures();
}

std::optional<double> figure(const Figures& figures, const char* name) {
  const double* value = find(figures, name);
  return value ? std::optional(*value) : std::nullopt;
}

ThesisTable meshes(const std::string& directory, int cores) {
  ThesisTable out{
      "Table 7.1: meshes, with and without remote visualization",
      {fmt::format("Ours is one view of {}x{} pixels a frame, paced to 60 a second at most, sampled at "
                   "1280x800 along an orbit; sampling and display share this machine's {} cores.",
                   kThesisWidth, kThesisHeight, cores),
       "Without remote visualization means there: the mesh is drawn on the display's machine; here: a ray a "
       "pixel, on all cores, of the same view.",
       "The thesis draws two views a frame, one for each eye, and its data sets are not here; what stands for "
       "them is named."},
      {"thesis: data set", "triangles", "without, fps", "with, fps", "ours", "triangles", "without, fps", "with, fps",
       "updates/s", "it is"},
      {}};
  for (const ThesisMesh& mesh : thesis_meshes()) {
    const std::string folder = fmt::format("{}/table-7.1/{}", directory, mesh.name);
    const Figures run = figures_of(folder + "/summary.json"), direct = figures_of(folder + "-direct/direct.json");
    const auto triangles = figure(run, "primitives");
    out.rows.push_back({mesh.thesis_name, mesh.thesis_triangles, number(mesh.thesis_without_fps, 0),
                        number(mesh.thesis_with_fps, 0), mesh.name,
                        triangles ? fmt::format("{:.2f} M", *triangles * 1e-6) : "-", number(figure(direct, "fps"), 2),
                        number(figure(run, "fps"), 1), number(figure(run, "updates_per_s"), 2), mesh.why});
  }
  return out;
}

ThesisTable scaling(const std::string& directory, int cores) {
  ThesisTable out{
      "Table 7.2: a Julia set's picture, rows computed by 1 to 40 nodes",
      {fmt::format("SIMULATED where it says so: {} cores cannot compute on 40 nodes, so each sampler, a real process, "
                   "waits as long as the rows of its leases cost when each was measured alone; leases, messages and "
                   "packing are real, and share the {} cores.",
                   cores, cores),
       "Rows are made to cost what they cost the thesis's single node (69.3 s a picture), or a 20th of it; computed "
       "rows "
       "cost what they cost here."},
      {"nodes", "thesis, s", "thesis, efficiency"},
      {}};
  const auto table = tools::CsvTable::read(directory + "/table-7.2/scaling.csv", {});
  std::map<int, std::map<std::string, std::pair<double, std::optional<double>>>> found;  // nodes -> series -> s, eff.
  std::vector<std::string> series;
  if (table)
    for (size_t i = 0; i < table->rows(); ++i) {
      const auto text = [&](const char* name) {
        const auto column = table->find(name);
        return column ? table->text(i, *column) : std::string();
      };
      const std::string name = text("series") + (text("simulated") == "1" ? ", SIMULATED" : "");
      if (std::find(series.begin(), series.end(), name) == series.end()) series.push_back(name);
      const std::string efficiency = text("efficiency");
      found[std::atoi(text("nodes").c_str())][name] = {
          std::atof(text("time_s").c_str()),
          efficiency.empty() ? std::nullopt : std::optional(std::atof(efficiency.c_str()))};
    }
  for (const std::string& name : series) out.head.insert(out.head.end(), {name + ", s", "efficiency"});
  for (const int nodes : {1, 2, 4, 8, 16, 32, 40}) {
    const auto thesis_s = thesis_time_s(nodes);
    std::vector<std::string> cells{std::to_string(nodes), number(thesis_s, 2),
                                   fmt::format("{:.1f} %", 100 * kThesisSingle_s / (nodes * thesis_s.value_or(1)))};
    for (const std::string& name : series) {
      const auto at = found[nodes].find(name);
      cells.push_back(at == found[nodes].end() ? "-" : number(at->second.first, 3));
      cells.push_back(at == found[nodes].end() || !at->second.second ? "-"
                                                                     : number(100 * *at->second.second, 1) + " %");
    }
    out.rows.push_back(std::move(cells));
  }
  return out;
}

ThesisTable volumes(VolumeTable which, const std::string& folder, bool quick, int cores) {
  const bool foot = which == VolumeTable::kFoot;
  const int servers = foot ? 4 : 6;
  ThesisTable out;
  out.title = foot ? "Table 7.3: frames a second of the foot, 256 x 256 x 256"
                   : "Table 7.4: frames a second of the Christmas tree, 512 x 499 x 512";
  out.notes = {
      foot ? std::string("The foot is not here; a CT of a bonsai, 256 x 256 x 256 of 8 bits, stands for it.")
           : fmt::format("The scan of the tree is not here; a made-up one, {0} x {0} x {0} of 16 bits, stands for it.",
                         quick ? 128 : 512),
      fmt::format("SIMULATED: every server and client has a processor of its own: what a view takes them was measured "
                  "alone on one thread, and is waited for; master, packer, data server and messages are real, on {} "
                  "cores.",
                  cores),
      fmt::format("Computed: everything computes, on these {} cores, so more processes only share them.", cores),
      "The thesis's servers and clients splat on graphics cards, and draw two views a frame."};
  out.head = {"clients", "whose"};
  for (int s = 1; s <= servers; ++s) out.head.push_back(fmt::format("{} server{}", s, s == 1 ? "" : "s"));
  const auto points = read_points(folder);
  const auto ours = [&](bool simulated, int samplers, int viewers) -> std::optional<double> {
    if (points)
      for (const VolumePoint& p : *points)
        if (p.simulated == simulated && p.samplers == samplers && p.viewers == viewers) return p.fps;
    return std::nullopt;
  };
  for (int clients = 1; clients <= 4; ++clients) {
    std::vector<std::string> thesis{std::to_string(clients), "thesis"}, simulated{"", "ours, SIMULATED"},
        computed{"", "ours, computed"};
    for (int s = 1; s <= servers; ++s) {
      const auto theirs = thesis_fps(which, s, clients);
      thesis.push_back(theirs ? fmt::format("{:g}", *theirs) : "-");
      simulated.push_back(number(ours(true, s, clients), 1));
      computed.push_back(number(ours(false, s, clients), 1));
    }
    out.rows.insert(out.rows.end(), {thesis, simulated, computed});
  }
  return out;
}

ThesisFigure timeline(const std::string& directory, const ThesisCoupling& c) {
  ThesisFigure out{fmt::format("Figure {}: workflow timeline, {}", c.figure, c.title),
                   fmt::format("figure-{}.svg", c.figure),
                   {},
                   {}};
  const std::string folder = fmt::format("{}/figure-{}", directory, c.figure);
  const Figures run = figures_of(folder + "/summary.json");
  const auto lanes = read_timeline(folder + "/trace.json");
  if (!lanes) {
    out.notes.push_back("It has not been measured yet.");
    return out;
  }
  out.notes.push_back(fmt::format(
      "A part of a run as its processes recorded it, all on this machine. Inter-frame delay: median {} ms, 95th "
      "percentile "
      "{} ms; view update latency: median {} ms; view construction: median {} ms.",
      number(figure(run, "inter_frame_delay_ms.median"), 1), number(figure(run, "inter_frame_delay_ms.p95"), 1),
      number(figure(run, "view_update_latency_ms.median"), 1), number(figure(run, "view_construction_ms.median"), 1)));
  out.svg = timeline_svg(*lanes, steady_part(*lanes), out.title);
  return out;
}

}  // namespace

ThesisReport read_results(const std::string& directory, const std::vector<std::string>& parts, bool quick, int cores) {
  ThesisReport out;
  for (const std::string& part : thesis_parts()) {
    if (std::find(parts.begin(), parts.end(), part) == parts.end()) continue;
    if (part == "6")
      for (const ThesisCoupling& c : thesis_couplings()) out.figures.push_back(timeline(directory, c));
    if (part == "7.1") out.tables.push_back(meshes(directory, cores));
    if (part == "7.2") out.tables.push_back(scaling(directory, cores));
    if (part == "7.3") out.tables.push_back(volumes(VolumeTable::kFoot, directory + "/table-7.3", quick, cores));
    if (part == "7.4") out.tables.push_back(volumes(VolumeTable::kTree, directory + "/table-7.4", quick, cores));
  }
  return out;
}

}  // namespace telesplat::launcher
