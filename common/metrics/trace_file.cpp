#include "common/metrics/trace_file.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace telesplat::metrics {
namespace {

constexpr size_t kWidth = 4;

// To the nanosecond.
double microseconds(double s) { return std::round(s * 1e9) / 1e3; }

std::string text_of(const nlohmann::json& event) {
  return event.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

bool TraceFile::open(const std::string& path, double begin_s) {
  begin_s_ = begin_s;
  if (!file_.open(path)) return false;
  file_.write("[\n");
  return true;
}

TraceFile::~TraceFile() { file_.write("\n]\n"); }

void TraceFile::event(const std::string& json) {
  file_.write((has_events_ ? ",\n" : "") + json);
  has_events_ = true;
}

void TraceFile::add(const Process& process, const wire::MetricRows& rows) {
  if (!file_.is_open()) return;
  if (named_.insert(process.name).second)
    event(text_of({{"ph", "M"}, {"name", "process_name"}, {"pid", process.pid}, {"args", {{"name", process.name}}}}));
  for (size_t i = 0; i + kWidth <= rows.values.size(); i += kWidth) {
    const double name = rows.values[i], begin_s = rows.values[i + 1], end_s = rows.values[i + 2];
    if (!(name >= 0 && name < double(rows.columns.size()))) continue;
    event(text_of({{"ph", "X"},
                   {"name", rows.columns[size_t(name)]},
                   {"pid", process.pid},
                   {"tid", int(rows.values[i + 3])},
                   {"ts", microseconds(begin_s - begin_s_)},
                   {"dur", microseconds(end_s - begin_s)}}));
  }
}

}  // namespace telesplat::metrics
