#include "common/metrics/run_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/utf8.h"
#include "common/metrics/columns.h"
#include "common/metrics/recorder.h"
#include "common/metrics/run_folder.h"
#include "common/metrics/summary.h"

namespace telesplat::metrics {
namespace {

std::string whole(uint64_t v) { return std::to_string(v); }
std::string seconds(double v) { return fmt::format("{:.9f}", v); }
// With as many digits as it has: displayed frames are made again from poses and times.
std::string exact(double v) { return fmt::format("{}", v); }

struct TileRow {
  const std::string& sampler;
  const wire::TileDone& tile;
  double begin_s;  // of the run

  // Empty: it did not happen.
  std::string moment(double master_s) const { return master_s > 0 ? seconds(master_s - begin_s) : ""; }
};
constexpr Column<TileRow, std::string> kTileColumns[] = {
    {"frame", [](const TileRow& r) { return whole(r.tile.frame.value); }},
    {"tile", [](const TileRow& r) { return whole(r.tile.tile); }},
    {"lease", [](const TileRow& r) { return whole(r.tile.lease.value); }},
    {"sampler", [](const TileRow& r) { return r.sampler; }},
    {"samples", [](const TileRow& r) { return whole(r.tile.samples); }},
    {"kept", [](const TileRow& r) { return whole(r.tile.kept); }},
    {"bytes_sampled", [](const TileRow& r) { return whole(r.tile.bytes_sampled); }},
    {"bytes_sent", [](const TileRow& r) { return whole(r.tile.bytes_sent); }},
    {"leased_s", [](const TileRow& r) { return r.moment(r.tile.moments.leased_s); }},
    {"sample_begin_s", [](const TileRow& r) { return r.moment(r.tile.moments.sample_begin_s); }},
    {"sample_end_s", [](const TileRow& r) { return r.moment(r.tile.moments.sample_end_s); }},
    {"encode_end_s", [](const TileRow& r) { return r.moment(r.tile.moments.encode_end_s); }},
    {"receive_s", [](const TileRow& r) { return r.moment(r.tile.moments.receive_s); }},
    {"packed_s", [](const TileRow& r) { return r.moment(r.tile.moments.packed_s); }},
    {"published_s", [](const TileRow& r) { return r.moment(r.tile.moments.published_s); }},
    {"x", [](const TileRow& r) { return std::to_string(r.tile.rect.x); }},
    {"y", [](const TileRow& r) { return std::to_string(r.tile.rect.y); }},
    {"width", [](const TileRow& r) { return std::to_string(r.tile.rect.width); }},
    {"height", [](const TileRow& r) { return std::to_string(r.tile.rect.height); }},
    {"step", [](const TileRow& r) { return whole(r.tile.step); }},
    {"rays", [](const TileRow& r) { return whole(r.tile.rays); }},
    {"extra", [](const TileRow& r) { return whole(r.tile.extra); }},
    {"request", [](const TileRow& r) { return r.tile.request.value ? whole(r.tile.request.value) : ""; }},
    {"requested_s", [](const TileRow& r) { return r.moment(r.tile.moments.requested_s); }},
    {"received_s", [](const TileRow& r) { return r.moment(r.tile.moments.received_s); }},
    {"begun_s", [](const TileRow& r) { return r.moment(r.tile.moments.begun_s); }},
    {"planned_s", [](const TileRow& r) { return r.moment(r.tile.moments.planned_s); }},
    {"lease_arrived_s", [](const TileRow& r) { return r.moment(r.tile.moments.lease_arrived_s); }},
    {"fetch_ms", [](const TileRow& r) { return exact(r.tile.moments.fetch_s * 1e3); }},
    {"arrived_s", [](const TileRow& r) { return r.moment(r.tile.moments.arrived_s); }},
};

bool is_time(const std::string& column) { return column.ends_with("_s"); }
bool is_moment(const std::string& column) { return is_time(column) && column != "t_s"; }

// Of a viewer's table. Moments count from the run's beginning.
std::string cell_of(const std::string& column, double value, double begin_s) {
  if (is_moment(column)) return seconds(value - begin_s);
  if (column == "display_ms" && value < 0) return "";  // no frame showed it
  return is_time(column) ? seconds(value) : exact(value);
}

// The scene's parameters and texts follow.
struct EpochRow {
  EpochId epoch;
  double t_s;
};
constexpr Column<EpochRow, std::string> kEpochColumns[] = {
    {"epoch", [](const EpochRow& r) { return whole(r.epoch.value); }},
    {"t_s", [](const EpochRow& r) { return seconds(r.t_s); }},
};

constexpr Column<Assignment, std::string> kAssignmentColumns[] = {
    {"partition", [](const Assignment& a) { return whole(a.partition); }},
    {"round", [](const Assignment& a) { return whole(a.round); }},
    {"data_server", [](const Assignment& a) { return csv_quoted(a.data_server); }},
    {"sampler", [](const Assignment& a) { return csv_quoted(a.sampler); }},
    {"begin", [](const Assignment& a) { return whole(a.begin); }},
    {"end", [](const Assignment& a) { return whole(a.end); }},
    {"bytes", [](const Assignment& a) { return whole(a.bytes); }},
};

template <class V>
std::vector<std::string> keys(const std::map<std::string, V>& map) {
  std::vector<std::string> out;
  for (const auto& [key, value] : map) out.push_back(key);
  return out;
}

void append(std::vector<std::string>& cells, const std::vector<std::string>& more) {
  cells.insert(cells.end(), more.begin(), more.end());
}

}  // namespace

Result<std::unique_ptr<RunRecord>> RunRecord::open(const std::string& directory, const Beginning& begin) {
  std::unique_ptr<RunRecord> out(new RunRecord);
  out->directory_ = directory;
  out->begin_ = begin;
  if (directory.empty()) return out;
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) return Error{fmt::format("{}: cannot be made a run folder: {}", directory, error.message())};
  if (const Status opened = out->open_files(); !opened) return opened.error();
  return out;
}

Status RunRecord::open_files() {
  if (!frames_file_.open(directory_ + "/frames.csv") || !updates_file_.open(directory_ + "/updates.csv") ||
      !stages_file_.open(directory_ + "/stages.csv") || !tiles_file_.open(directory_ + "/tiles.csv") ||
      !epochs_file_.open(directory_ + "/epochs.csv") || !trace_.open(directory_ + "/trace.json", begin_.monotonic_s))
    return Error{fmt::format("{}: cannot write into it: {}", directory_, std::strerror(errno))};
  tiles_file_.write(csv_line(names(kTileColumns)));
  return ok_status();
}

TextFile& RunRecord::file_of(const std::string& table) {
  return table == "frames" ? frames_file_ : table == "stages" ? stages_file_ : updates_file_;
}

Status RunRecord::add_rows(const Process& process, const wire::MetricRows& rows) {
  if (rows.table == "spans") {
    if (rows.values.size() % kSpanWidth)
      return Error{fmt::format("spans hold {} values, not a multiple of {}", rows.values.size(), kSpanWidth)};
    trace_.add(process, rows);
    return ok_status();
  }
  const Rows* table = measured_.table(rows.table);
  if (!table) return Error{fmt::format("metrics table '{}' is unknown", to_utf8(rows.table.substr(0, 32)))};
  const bool first = table->columns.empty();
  if (Status added = measured_.add(process.name, rows); !added) return added;
  TextFile& file = file_of(rows.table);
  if (!file.is_open()) return ok_status();
  if (first) {
    std::vector<std::string> header{"viewer"};
    append(header, rows.columns);
    file.write(csv_line(header));
  }
  for (size_t i = 0; i < rows.values.size(); i += rows.columns.size()) {
    std::vector<std::string> cells{process.name};
    for (size_t c = 0; c < rows.columns.size(); ++c)
      cells.push_back(cell_of(rows.columns[c], rows.values[i + c], begin_.monotonic_s));
    file.write(csv_line(cells));
  }
  file.flush();
  return ok_status();
}

void RunRecord::add_tile(const std::string& sampler, const wire::TileDone& tile) {
  measured_.tiles.push_back(tile);
  measured_.busy_s[sampler] += std::max(0.0, tile.moments.encode_end_s - tile.moments.sample_begin_s);
  trace_.add_lease(sampler, tile);
  if (tiles_file_.is_open())
    tiles_file_.write(csv_line(values(kTileColumns, TileRow{sampler, tile, begin_.monotonic_s})));
}

void RunRecord::add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                          const std::map<std::string, std::string>& texts) {
  if (measured_.epochs++ == 0) {
    epoch_columns_ = keys(parameters);
    epoch_texts_ = keys(texts);
    std::vector<std::string> header = names(kEpochColumns);
    append(header, epoch_columns_);
    append(header, epoch_texts_);
    epochs_file_.write(csv_line(header));
  }
  std::vector<std::string> cells = values(kEpochColumns, EpochRow{epoch, t_s - begin_.monotonic_s});
  for (const std::string& name : epoch_columns_) {
    const auto found = parameters.find(name);
    cells.push_back(found == parameters.end() ? "" : exact(found->second));  // the frame can be made again from it
  }
  for (const std::string& name : epoch_texts_) {
    const auto found = texts.find(name);
    cells.push_back(found == texts.end() ? "" : csv_quoted(found->second));
  }
  epochs_file_.write(csv_line(cells));
  epochs_file_.flush();
}

void RunRecord::add_assignment(const std::vector<Assignment>& transfers) {
  if (directory_.empty()) return;
  if (!assignment_file_.is_open() && assignment_file_.open(directory_ + "/assignment.csv"))
    assignment_file_.write(csv_line(names(kAssignmentColumns)));
  for (const Assignment& a : transfers) assignment_file_.write(csv_line(values(kAssignmentColumns, a)));
  assignment_file_.flush();
}

void RunRecord::add_plan(const std::string& viewer, const PlanRow& plan) {
  // The summary needs no more of it, and a session may last for hours.
  PlanRow& kept = measured_.plans.emplace_back(plan);
  trace_.add_plan(viewer, plan);
  std::erase_if(kept.figures, [](const auto& figure) { return figure.first != "plan_ms"; });
  if (directory_.empty()) return;
  if (!plans_file_.is_open() && plans_file_.open(directory_ + "/plans.csv"))
    plans_file_.write(csv_line(plan_columns()));
  plans_file_.write(csv_line(plan_cells(viewer, plan, begin_.monotonic_s)));
}

nlohmann::ordered_json RunRecord::summary(const std::vector<Process>& processes,
                                          const std::map<std::string, double>& counters, About about) const {
  about.begin = begin_;
  return summarise(measured_, processes, counters, about);
}

Status RunRecord::finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                         const About& about) {
  if (directory_.empty()) return ok_status();
  tiles_file_.flush();
  plans_file_.flush();
  const std::string path = directory_ + "/summary.json";
  std::ofstream out(path + ".part");
  out << summary(processes, counters, about).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
      << "\n";
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(path + ".part", path, error);
  if (!out || error) return Error{fmt::format("{}: cannot be written", path)};
  if (!measured_.frames.values.empty()) point_latest(directory_);
  return ok_status();
}

}  // namespace telesplat::metrics
