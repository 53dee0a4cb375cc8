#include "services/master/record/trace_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/metrics/recorder.h"

namespace telesplat::metrics {
namespace {

using nlohmann::json;

// Returns microseconds, rounded to the nanosecond.
double microseconds(double s) { return std::round(s * 1e9) / 1e3; }

std::string text_of(const json& event) { return event.dump(-1, ' ', false, json::error_handler_t::replace); }

const char* lane_name(const std::string& role, int lane) {
  if (role == "viewer") return lane == 0 ? "display" : lane == 1 ? "receiving" : lane == 3 ? "epochs" : "view updates";
  if (role == "sampler") return "sampling";
  if (role == "packer") return "packing";
  return "work";
}

constexpr double kMostNumber = 9007199254740992;  // 2^53: peers may send any number
constexpr int kMostLanes = 16;
constexpr int kMostProcesses = 10000;  // in a life; further ones share a number
constexpr size_t kMostTraceLives = 100000;

// Returns those of the three that are known, above or equal to 0.
json args_of(double frame, double tile, double request) {
  json out = json::object();
  const auto add = [&](const char* key, double number) {
    if (number >= 0 && number <= kMostNumber) out[key] = uint64_t(number);
  };
  add("frame", frame);
  add("tile", tile);
  add("request", request);
  return out;
}

}  // namespace

bool TraceFile::open(const std::string& path, double begin_s, uint64_t limit_bytes) {
  begin_s_ = begin_s;
  if (!file_.open(path, limit_bytes)) return false;
  file_.write("[\n");
  return true;
}

bool TraceFile::open_behind(const std::string& path, double begin_s, uint64_t keep_bytes, size_t life,
                            uint64_t limit_bytes) {
  first_number_ = 1 + int(std::min<size_t>(life - 1, kMostTraceLives)) * kMostProcesses;
  span_ = uint64_t{life - 1} << 40;
  if (keep_bytes == 0) return open(path, begin_s, limit_bytes);
  begin_s_ = begin_s;
  has_events_ = keep_bytes > 2;
  return file_.open_behind(path, keep_bytes, limit_bytes);
}

void TraceFile::close() {
  file_.write_end("\n]\n");
  file_.close();
}

void TraceFile::event(const json& event) {
  file_.write((has_events_ ? ",\n" : "") + text_of(event));
  has_events_ = true;
}

// Returns the number of a process in the file: processes of several machines may have the same pid.
int TraceFile::number_of(const std::string& process, const std::string& role, uint64_t pid) {
  if (processes_.size() >= size_t(kMostProcesses) - 1 && !processes_.contains(process))
    return first_number_ + kMostProcesses - 1;
  const auto [known, is_new] = processes_.try_emplace(process, first_number_ + int(processes_.size()));
  const int number = known->second;
  if (!is_new) return number;
  const auto tell = [&](const char* what, json args) {
    event({{"ph", "M"}, {"name", what}, {"pid", number}, {"tid", 0}, {"args", std::move(args)}});
  };
  tell("process_name", {{"name", process}});
  if (pid > 0) tell("process_labels", {{"labels", role + ", pid " + std::to_string(pid)}});
  return number;
}

void TraceFile::name_lane(int process, const std::string& role, int lane) {
  if (!lanes_.insert({process, lane}).second) return;
  event({{"ph", "M"},
         {"name", "thread_name"},
         {"pid", process},
         {"tid", lane},
         {"args", {{"name", lane_name(role, lane)}}}});
}

void TraceFile::add(const Process& process, const wire::MetricRows& rows) {
  if (!file_.is_open()) return;
  const int number = number_of(process.name, process.role, process.pid);
  for (size_t i = 0; i + kSpanWidth <= rows.values.size(); i += kSpanWidth) {
    const double name = rows.values[i], begin_s = rows.values[i + 1], end_s = rows.values[i + 2];
    if (!(name >= 0 && name < double(rows.columns.size()))) continue;
    if (!(rows.values[i + 3] >= kOverlapping && rows.values[i + 3] < kMostLanes)) continue;
    const int lane = int(rows.values[i + 3]);
    const double request = rows.values[i + 6];
    json args = args_of(rows.values[i + 4], rows.values[i + 5], request);
    if (lane == kOverlapping) {
      overlapping(number, rows.columns[size_t(name)], process.role, begin_s, end_s, std::move(args));
      continue;
    }
    name_lane(number, process.role, lane);
    event({{"ph", "X"},
           {"name", rows.columns[size_t(name)]},
           {"cat", process.role},
           {"pid", number},
           {"tid", lane},
           {"ts", microseconds(begin_s - begin_s_)},
           {"dur", microseconds(end_s - begin_s)},
           {"args", std::move(args)}});
  }
}

// Adds a span as two events with an id, so that it may overlap others of its kind.
void TraceFile::overlapping(int process, const std::string& name, const std::string& category, double begin_s,
                            double end_s, json args) {
  json out{{"ph", "b"},
           {"name", name},
           {"cat", category},
           {"id", ++span_},
           {"pid", process},
           {"tid", 0},
           {"ts", microseconds(begin_s - begin_s_)},
           {"args", std::move(args)}};
  event(out);
  out["ph"] = "e";
  out["ts"] = microseconds(std::max(begin_s, end_s) - begin_s_);
  out.erase("args");
  event(out);
}

void TraceFile::add_lease(const std::string& sampler, const wire::TileDone& t) {
  if (!file_.is_open()) return;
  json args = args_of(double(t.frame.value), double(t.tile), t.request.value ? double(t.request.value) : -1);
  args["lease"] = t.lease.value;
  args["sampler"] = sampler;
  overlapping(number_of("master", "master", 0), "lease", "lease", t.moments.leased_s, t.moments.packed_s,
              std::move(args));
}

void TraceFile::add_plan(const std::string& viewer, const PlanRow& p) {
  if (!file_.is_open()) return;
  json args = args_of(double(p.asked.frame.value), -1, double(p.asked.request.value));
  args["viewer"] = viewer;
  args["extra"] = p.asked.extra;
  overlapping(number_of("master", "master", 0), p.asked.extra ? "plan of extra rays" : "plan", "plan", p.asked_s,
              p.planned_s, std::move(args));
}

}  // namespace telesplat::metrics
