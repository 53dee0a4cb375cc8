#include "tools/telesplat/bench/thesis/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "common/core/whole_file.h"
#include "common/metrics/statistics.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/report/reading/trace_reader.h"
#include "tools/telesplat/sweep/plot.h"

namespace telesplat::launcher {
namespace {

constexpr double kLabel = 250, kChart = 860, kLane = 24, kBar = 16, kTop = 34, kBottom = 54;
constexpr double kUpdates = 4, kLeast_s = 0.2, kMost_s = 3, kSettled = 0.6;
constexpr const char* kUpdateSpan = "view update";

std::string names_of(const TimelineLane& lane) {
  std::set<std::string> names;
  for (const TimelineSpan& span : lane.spans) names.insert(span.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

// Holds where the picture is part of a page, too.
const char* style() {
  return "<style>.timeline text{font:12px system-ui,sans-serif;fill:#444}.timeline .h{font-weight:600;fill:#111}"
         ".timeline .g{stroke:#ddd}.timeline .e{text-anchor:end}.timeline .m{text-anchor:middle}.timeline .back"
         "{fill:#fff}.timeline .s0{fill:#2f6fde}.timeline .s1{fill:#d9642b}.timeline .s2{fill:#2c9b6a}.timeline "
         ".s3{fill:#a24bc9}.timeline .s4{fill:#c8981a}.timeline .s5{fill:#0f98a8}.timeline .s6{fill:#c43b6d}.timeline "
         ".s7{fill:#6b7280}.timeline .s8{fill:#9aa834}.timeline .s9{fill:#7a5b3a}.timeline "
         ".bar{stroke:#fff;stroke-width:.5}</style>";
}

// A span's colour does not depend on what else is there.
size_t colour_of(const std::string& name) {
  static const std::map<std::string, size_t> known{
      {"display frame", 0}, {"wait for update", 7}, {"decode", 5}, {"insert", 4}, {"view update", 3},
      {"sample", 1},        {"encode", 6},          {"pack", 2},   {"plan", 8},   {"settle", 9}};
  if (const auto found = known.find(name); found != known.end()) return found->second;
  size_t sum = 0;
  for (const unsigned char c : name) sum += c;
  return sum % 10;
}

// Spans of a lane that overlap (several view updates are under way) lie in rows of their own.
std::vector<std::vector<TimelineSpan>> rows_of(const TimelineLane& lane, const TimeSpan& part) {
  std::vector<TimelineSpan> seen;
  for (const TimelineSpan& s : lane.spans)
    if (s.end_s > part.begin_s && s.begin_s < part.end_s) seen.push_back(s);
  std::stable_sort(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.begin_s < b.begin_s; });
  std::vector<std::vector<TimelineSpan>> rows;
  for (const TimelineSpan& s : seen) {
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return r.back().end_s <= s.begin_s; });
    if (row != rows.end())
      row->push_back(s);
    else
      rows.push_back({s});
  }
  return rows;
}

// Which colour is what, in lines below the picture.
struct Legend {
  std::string svg;
  double height = 0;  // of the lines after the first
};
Legend legend(const std::set<std::string>& names, double y) {
  constexpr double kLine = 18;
  Legend out;
  double x = kLabel;
  for (const std::string& name : names) {
    const double width = 16 + 7.2 * double(tools::width_of(name)) + 18;
    if (x > kLabel && x + width > kLabel + kChart) x = kLabel, y += kLine, out.height += kLine;
    out.svg += fmt::format(
        "<rect class=\"s{}\" x=\"{:.0f}\" y=\"{:.1f}\" width=\"11\" height=\"11\"/><text x=\"{:.0f}\" "
        "y=\"{:.1f}\">{}</text>",
        colour_of(name), x, y - 10, x + 16, y, escaped(name));
    x += width;
  }
  return out;
}

}  // namespace

Result<std::vector<TimelineLane>> read_timeline(const std::string& path) {
  if (const Status s = check_readable(path, kMostTableBytes); !s) return s.error();
  std::ifstream in(path, std::ios::binary);
  const Trace trace = read_trace(in);
  if (!trace.whole) return Error{fmt::format("{}: is no trace", path)};
  std::vector<TimelineLane> out;
  for (const TraceLane& lane : trace.lanes) out.push_back({lane.process, lane.async ? "" : lane.name, {}});
  for (const TraceEvent& e : trace.events)
    out[e.lane].spans.push_back({trace.names[e.name], e.begin_us * 1e-6, (e.begin_us + e.duration_us) * 1e-6});
  std::erase_if(out, [](const TimelineLane& lane) { return lane.spans.empty(); });
  for (TimelineLane& lane : out)
    if (lane.lane.empty()) lane.lane = names_of(lane);
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.process < b.process; });
  return out;
}

TimeSpan steady_part(const std::vector<TimelineLane>& lanes) {
  double begin_s = 1e300, end_s = 0;
  std::vector<double> updates_s;
  for (const TimelineLane& lane : lanes)
    for (const TimelineSpan& s : lane.spans) {
      begin_s = std::min(begin_s, s.begin_s), end_s = std::max(end_s, s.end_s);
      if (s.name == kUpdateSpan) updates_s.push_back(s.end_s - s.begin_s);
    }
  if (end_s <= 0) return {0, kLeast_s};
  const double length_s = std::clamp(kUpdates * metrics::distribution(updates_s).median, kLeast_s, kMost_s);
  const double from_s = begin_s + kSettled * (end_s - begin_s);
  return {from_s, from_s + length_s};
}

std::string timeline_svg(const std::vector<TimelineLane>& lanes, const TimeSpan& part, const std::string& title) {
  const double length_s = part.end_s - part.begin_s;
  const auto x = [&](double s) { return kLabel + kChart * std::clamp((s - part.begin_s) / length_s, 0.0, 1.0); };
  std::string body;
  std::set<std::string> names;
  double y = kTop;
  for (const TimelineLane& lane : lanes) {
    const auto rows = rows_of(lane, part);
    if (rows.empty()) continue;
    body += fmt::format("<text class=\"e\" x=\"{:.0f}\" y=\"{:.1f}\">{}</text>", kLabel - 8, y + kBar - 3,
                        escaped(tools::shortened(lane.process + ": " + lane.lane, 38)));
    for (const auto& row : rows) {
      for (const TimelineSpan& s : row) {
        names.insert(s.name);
        body += fmt::format(
            "<rect class=\"bar s{}\" x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.0f}\"><title>{}: {:.2f} "
            "ms</title></rect>",
            colour_of(s.name), x(s.begin_s), y, std::max(0.6, x(s.end_s) - x(s.begin_s)), kBar, escaped(s.name),
            (s.end_s - s.begin_s) * 1e3);
      }
      y += kLane - (&row == &rows.back() ? 0 : kLane - kBar - 2);
    }
  }
  const Scale scale = scale_of(0, length_s * 1e3, true);
  std::string grid;
  for (double ms = 0; ms <= length_s * 1e3 + 1e-9; ms += scale.step)
    grid += fmt::format(
        "<line class=\"g\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.0f}\" y2=\"{2:.1f}\"/><text class=\"m\" "
        "x=\"{0:.1f}\" y=\"{3:.1f}\">{4:.6g} ms</text>",
        x(part.begin_s + ms * 1e-3), kTop - 6, y, y + 16, ms);
  const Legend colours = legend(names, y + 42);
  const double width = kLabel + kChart + 30, height = y + kBottom + colours.height;
  return fmt::format(
      "<svg class=\"timeline\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\">"
      "{2}<rect class=\"back\" width=\"{0:.0f}\" height=\"{1:.0f}\"/><text class=\"h\" x=\"8\" y=\"18\">{3}</text>"
      "{4}{5}{6}</svg>\n",
      width, height, style(), escaped(title), grid, body, colours.svg);
}

}  // namespace telesplat::launcher
