#include "tools/telesplat/report/trace_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

// What lanes are for, in traces that do not name them: a name of their spans, and the lane's.
constexpr std::array kKnownLanes{std::pair{"display frame", "display"}, std::pair{"wait for update", "display"},
                                 std::pair{"view update", "update"}, std::pair{"insert", "receive"},
                                 std::pair{"epoch held", "epochs"}};

std::string role_of(const std::string& process) {
  for (const char* role : {"viewer", "packer", "sampler", "master", "data"})
    if (process.starts_with(role)) return role;
  return {};
}

ordered_json lanes_json(const Trace& trace) {
  std::vector<std::string> told(trace.lanes.size());
  for (const auto& e : trace.events)
    if (told[e.lane].empty())
      for (const auto& [span, lane] : kKnownLanes)
        if (trace.names[e.name] == span) told[e.lane] = lane;
  ordered_json out = ordered_json::array();
  for (size_t i = 0; i < trace.lanes.size(); ++i) {
    const TraceLane& lane = trace.lanes[i];
    out.push_back({{"process", lane.process},
                   {"role", role_of(lane.process)},
                   {"lane", !lane.name.empty() ? lane.name : told[i]},
                   {"tid", lane.tid}});
  }
  return out;
}

}  // namespace

ordered_json trace_json(const Trace& trace, double origin_s, double begin_s, double end_s, size_t share,
                        size_t windows) {
  const auto chosen = choose_windows(trace.events, begin_s * 1e6, end_s * 1e6, share, windows);
  ordered_json out{{"lanes", lanes_json(trace)},
                   {"names", trace.names},
                   {"of", trace.events.size()},
                   {"all", chosen.all},
                   {"left_out", trace.left_out},
                   {"open", trace.open},
                   {"whole", trace.whole},
                   {"windows", ordered_json::array()},
                   {"lane", ordered_json::array()},
                   {"name", ordered_json::array()},
                   {"begin", ordered_json::array()},
                   {"duration", ordered_json::array()},
                   {"frame", ordered_json::array()},
                   {"tile", ordered_json::array()},
                   {"request", ordered_json::array()}};
  for (const auto& [from, to] : chosen.windows_us)
    out["windows"].push_back({std::round(from - origin_s * 1e6), std::round(to - origin_s * 1e6)});
  // Begins as distances from the one before: short numbers.
  int64_t before = 0;
  const auto add = [&](const char* key) { return [&list = out[key]](int64_t v) { list.push_back(v); }; };
  const auto lane = add("lane"), name = add("name"), begin = add("begin"), duration = add("duration"),
             frame = add("frame"), tile = add("tile"), request = add("request");
  for (const size_t i : chosen.events) {
    const TraceEvent& e = trace.events[i];
    const auto at = int64_t(std::llround(e.begin_us - origin_s * 1e6));
    lane(e.lane), name(e.name), begin(at - before), duration(std::llround(e.duration_us));
    frame(e.frame), tile(e.tile), request(e.request);
    before = at;
  }
  return out;
}

ordered_json trace_part(const std::string& directory, const RunTables& tables, size_t share, size_t windows) {
  const std::string path = directory + "/trace.json";
  if (!lies_within(directory, "trace.json")) return {{"why", "trace.json is a symbolic link"}};
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return {{"why", "trace.json is not there"}};
  std::ifstream in(path, std::ios::binary);
  const Trace trace = read_trace(in);
  if (trace.events.empty()) return {{"why", "trace.json holds no spans"}};
  double begin_s = tables.origin_s, end_s = tables.end_s;
  if (!(end_s > begin_s)) begin_s = trace.events.front().begin_us / 1e6, end_s = trace.events.back().begin_us / 1e6;
  return trace_json(trace, tables.origin_s, begin_s, end_s, share, windows);
}

}  // namespace telesplat::launcher
