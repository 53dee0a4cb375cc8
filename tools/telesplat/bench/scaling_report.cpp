#include "tools/telesplat/bench/scaling_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

namespace telesplat::launcher {
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

double ComputedResult::busy_spread() const {
  double sum = 0;
  for (const double b : busy_s) sum += b;
  if (busy_s.empty() || sum <= 0) return 0;
  const auto [least, most] = std::minmax_element(busy_s.begin(), busy_s.end());
  return (*most - *least) / (sum / double(busy_s.size()));
}

std::string to_text(const ScalingSeries& s, int cores) {
  std::string out = fmt::format("{}: rows of {:.3f} s a frame in all\n", s.name, s.row_seconds);
  if (s.simulated)
    out += fmt::format(
        "  simulated: the samplers are real processes, all on {} cores; each row waits its measured cost x scale, then "
        "the row as "
        "sampled before is encoded and sent\n",
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

std::string to_text(const ComputedResult& r) {
  std::string out = fmt::format(
      "computed, {} sampler{} of one thread, {} frames: {:.1f} ms median, {:.1f} ms p95 from request to complete: "
      "{:.0f} "
      "times the thesis's single node\n",
      r.samplers, r.samplers == 1 ? "" : "s", r.frames, r.median_s * 1e3, r.p95_s * 1e3, kThesisSingle_s / r.median_s);
  if (r.busy_s.size() > 1) {
    out += "  busy:";
    for (const double b : r.busy_s) out += fmt::format(" {:.3f} s", b);
    out += fmt::format(", spread {:.1f} %\n", r.busy_spread() * 100);
  }
  return out;
}

std::string to_text(const KillResult& r) {
  return fmt::format("a sampler of {} killed in mid-frame ({}): {:.3f} s instead of {:.3f} s, {:.2f} times as long\n",
                     r.nodes, r.name, r.killed_s, r.normal_s, r.killed_s / r.normal_s);
}

Status write_report(const ScalingReport& report, const std::string& directory) {
  nlohmann::ordered_json json{{"schema", 1},
                              {"scene", report.scene},
                              {"size", {report.width, report.height}},
                              {"cores", report.cores},
                              {"series", nlohmann::ordered_json::array()},
                              {"computed", nlohmann::ordered_json::array()},
                              {"kills", nlohmann::ordered_json::array()},
                              {"thesis", nlohmann::ordered_json::array()}};
  std::string csv = "series,simulated,row_seconds,nodes,frames,time_s,speed_up,efficiency,thesis_s,thesis_efficiency\n";
  const auto value = [](const std::optional<double>& v) { return v ? fmt::format("{:.6f}", *v) : std::string(); };
  for (const auto& s : report.series) {
    nlohmann::ordered_json series{{"name", s.name}, {"simulated", s.simulated}, {"row_seconds", s.row_seconds}};
    series["points"] = nlohmann::ordered_json::array();
    for (const auto& p : s.points) {
      nlohmann::ordered_json point{{"nodes", p.nodes}, {"frames", p.frames}, {"time_s", p.time_s}};
      if (const auto v = s.speed_up(p)) point["speed_up"] = *v, point["efficiency"] = *v / p.nodes;
      series["points"].push_back(point);
      csv += fmt::format("{},{},{:.6f},{},{},{:.6f},{},{},{},{}\n", s.name, int(s.simulated), s.row_seconds, p.nodes,
                         p.frames, p.time_s, value(s.speed_up(p)), value(s.efficiency(p)),
                         value(thesis_time_s(p.nodes)), value(thesis_efficiency(p.nodes)));
    }
    json["series"].push_back(series);
  }
  for (const auto& c : report.computed)
    json["computed"].push_back({{"samplers", c.samplers},
                                {"frames", c.frames},
                                {"median_s", c.median_s},
                                {"p95_s", c.p95_s},
                                {"busy_s", c.busy_s},
                                {"busy_spread", c.busy_spread()},
                                {"times_the_thesis", kThesisSingle_s / c.median_s}});
  for (const auto& k : report.kills)
    json["kills"].push_back({{"name", k.name}, {"nodes", k.nodes}, {"normal_s", k.normal_s}, {"killed_s", k.killed_s}});
  for (const int n : {1, 2, 4, 8, 16, 32, 40})
    json["thesis"].push_back({{"nodes", n}, {"time_s", *thesis_time_s(n)}, {"efficiency", *thesis_efficiency(n)}});
  for (const auto& [name, text] :
       {std::pair{"/scaling.csv", csv},
        {"/scaling.json", json.dump(2, ' ', false, decltype(json)::error_handler_t::replace) + "\n"}}) {
    std::ofstream out(directory + name);
    out << text;
    out.close();
    if (!out) return Error{directory + name + ": cannot be written"};
  }
  return ok_status();
}

Result<std::vector<double>> busy_times(const std::string& path, RequestId after) {
  std::ifstream in(path);
  std::string line, cell;
  std::map<std::string, size_t> column;
  if (!std::getline(in, line)) return Error{path + ": cannot be read"};
  std::stringstream head(line);
  for (size_t i = 0; std::getline(head, cell, ','); ++i) column[cell] = i;
  for (const char* name : {"sampler", "request", "sample_begin_s", "encode_end_s"})
    if (!column.contains(name)) return Error{fmt::format("{}: has no column {}", path, name)};
  std::map<std::string, double> busy;
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    std::stringstream row(line);
    while (std::getline(row, cell, ',')) cells.push_back(cell);
    if (cells.size() < column.size()) continue;
    const auto at = [&](const char* name) { return std::strtod(cells[column[name]].c_str(), nullptr); };
    if (at("request") > static_cast<double>(after.value))
      busy[cells[column["sampler"]]] += at("encode_end_s") - at("sample_begin_s");
  }
  if (busy.empty()) return Error{fmt::format("{}: has no tile of a request after {}", path, after.value)};
  std::vector<double> out;
  for (const auto& [name, seconds] : busy) out.push_back(seconds);
  return out;
}

}  // namespace telesplat::launcher
