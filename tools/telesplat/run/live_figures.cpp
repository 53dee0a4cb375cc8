#include "tools/telesplat/run/live_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace telesplat::launcher {
namespace {

// Rates cover at least this time: frames that come in bursts look steady, a change still shows soon.
constexpr double kWindow_s = 4;
// A viewer without a report for this long counts as displaying nothing.
constexpr double kSilence_s = 3.5;

}  // namespace

double SessionFigures::Viewer::rate(double Report::*counter) const {
  if (reports.size() < 2) return 0;
  const double seconds = reports.back().at_s - reports.front().at_s;
  return seconds > 0 ? (reports.back().*counter - reports.front().*counter) / seconds : 0;
}

void SessionFigures::take(Viewer& viewer, const nlohmann::json& values, double now_s) {
  if (values == viewer.values) return;  // the report is not new
  viewer.values = values;
  viewer.heard_s = now_s;
  const Report report{values.value("reported_s", now_s), values.value("frames", 0.0), values.value("updates", 0.0),
                      values.value("bytes_received", 0.0)};
  auto& reports = viewer.reports;
  if (!reports.empty() && (report.frames < reports.back().frames || report.at_s < reports.back().at_s)) reports.clear();
  // Frames before the first picture must not lower the rate.
  if (reports.size() == 1 && reports.front().frames == 0) reports.clear();
  reports.push_back(report);
  while (reports.size() > 2 && reports[1].at_s <= report.at_s - kWindow_s) reports.pop_front();
}

std::string SessionFigures::update(const nlohmann::json& status, double now_s) {
  double fps = 0, updates = 0, bytes = 0, points = 0;
  int samplers = 0, viewers = 0, showing = 0;
  for (const auto& p : status.value("processes", nlohmann::json::array())) {
    const std::string role = p.value("role", "");
    if (!p.value("alive", false)) continue;
    samplers += role == "sampler";
    viewers += role == "viewer";
    if (role != "viewer" || !p.contains("values")) continue;
    Viewer& viewer = viewers_[p.value("name", "") + fmt::format("/{}", p.value("pid", 0))];
    take(viewer, p["values"], now_s);
    points = std::max(points, p["values"].value("points", 0.0));
    if (viewer.reports.size() < 2) continue;
    ++showing;
    if (now_s - viewer.heard_s > kSilence_s) continue;
    fps += viewer.rate(&Report::frames);
    updates += viewer.rate(&Report::updates);
    bytes += viewer.rate(&Report::bytes);
  }
  if (showing == 0) return {};
  std::string text = fmt::format("{:5.1f} fps  {:4.1f} updates/s  ", fps / showing, updates / showing);
  if (points > 0) text += fmt::format("{:5.2f} M points  ", points / 1e6);
  text += fmt::format("{:5.2f} MB/s  {} sampler{}", bytes / 1e6, samplers, samplers == 1 ? "" : "s");
  if (viewers > 1) text += fmt::format(", each of {} viewers", viewers);
  return text;
}

std::vector<std::string> viewer_results(const nlohmann::json& status, const std::vector<std::string>& names) {
  std::vector<std::string> out;
  const auto empty = nlohmann::json::object();
  for (const auto& p : status.value("processes", nlohmann::json::array())) {
    const std::string name = p.value("name", "");
    if (std::find(names.begin(), names.end(), name) == names.end() || !p.contains("values")) continue;
    const auto values = p["values"], rates = p.value("rates", empty);
    std::string line = fmt::format("{}: {:.0f} frames", name, values.value("frames", 0.0));
    if (rates.contains("frames")) line += fmt::format(", {:.1f} fps at the end", rates.value("frames", 0.0));
    line += fmt::format(", {:.0f} view updates", values.value("updates", 0.0));
    if (const double points = values.value("points", 0.0); points > 0)
      line += fmt::format(", {:.2f} M points at the end", points / 1e6);
    out.push_back(line + fmt::format(", {:.1f} MB received", values.value("bytes_received", 0.0) / 1e6));
  }
  return out;
}

void ProcessorWait::look(pid_t process, double now_s) {
  double ran_ns = 0, waited_ns = 0;
  if (!(std::ifstream(fmt::format("/proc/{}/schedstat", process)) >> ran_ns >> waited_ns)) return;
  last_s_ = now_s, last_waited_s_ = waited_ns * 1e-9;
  if (first_s_ == 0) first_s_ = last_s_, first_waited_s_ = last_waited_s_;
}

}  // namespace telesplat::launcher
