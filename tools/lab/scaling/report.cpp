#include "tools/lab/scaling/report.h"

#include <fmt/format.h>

#include <map>

#include "common/core/whole_file.h"

namespace telesplat::lab {
namespace {

std::string number(const std::optional<double>& v, int decimals) {
  return v ? fmt::format("{:.{}f}", *v, decimals) : std::string("-");
}
std::optional<double> thesis_efficiency(int nodes) {
  const auto t = thesis_time_s(nodes);
  if (!t) return std::nullopt;
  return kThesisSingle_s / (nodes * *t);
}
std::optional<double> percent(const std::optional<double>& v) { return v ? std::optional(*v * 100) : std::nullopt; }

}  // namespace

std::optional<double> thesis_time_s(int nodes) {
  static const std::map<int, double> table{{1, kThesisSingle_s}, {2, 34.8},  {4, 17.3}, {8, 8.7},
                                           {16, 4.36},           {32, 2.19}, {40, 1.76}};
  const auto it = table.find(nodes);
  return it == table.end() ? std::nullopt : std::optional(it->second);
}

std::optional<double> ScalingSeries::speed_up(const ScalingPoint& p) const {
  for (const auto& one : points)
    if (one.nodes == 1) return one.time_s / p.time_s;
  return std::nullopt;
}

std::optional<double> ScalingSeries::efficiency(const ScalingPoint& p) const {
  const auto s = speed_up(p);
  return s ? std::optional(*s / p.nodes) : std::nullopt;
}

std::string to_text(const ScalingSeries& s, int cores) {
  std::string out = fmt::format("{}: rows of {:.3f} s a frame in all\n", s.name, s.row_seconds);
  if (s.simulated)
    out += fmt::format(
        "  simulated: the samplers are real processes, all on {} cores; each row waits its measured cost x scale, then "
        "the row as sampled before is encoded and sent\n",
        cores);
  else
    out += fmt::format("  computed: the samplers sample every frame anew, one thread each, on {} cores\n", cores);
  out += "  nodes    time s  speed-up  efficiency   thesis s  efficiency\n";
  for (const auto& p : s.points)
    out += fmt::format("  {:5} {:9.4f} {:>9} {:>9} % {:>10} {:>9} %\n", p.nodes, p.time_s, number(s.speed_up(p), 2),
                       number(percent(s.efficiency(p)), 1), number(thesis_time_s(p.nodes), 2),
                       number(percent(thesis_efficiency(p.nodes)), 1));
  return out;
}

Status write_report(const std::vector<ScalingSeries>& all, const std::string& directory) {
  std::string csv = "series,simulated,row_seconds,nodes,frames,time_s,speed_up,efficiency,thesis_s,thesis_efficiency\n";
  const auto value = [](const std::optional<double>& v) { return v ? fmt::format("{:.6f}", *v) : std::string(); };
  for (const auto& s : all)
    for (const auto& p : s.points)
      csv += fmt::format("{},{},{:.6f},{},{},{:.6f},{},{},{},{}\n", s.name, int(s.simulated), s.row_seconds, p.nodes,
                         p.frames, p.time_s, value(s.speed_up(p)), value(s.efficiency(p)),
                         value(thesis_time_s(p.nodes)), value(thesis_efficiency(p.nodes)));
  return write_whole(directory + "/scaling.csv", csv);
}

}  // namespace telesplat::lab
