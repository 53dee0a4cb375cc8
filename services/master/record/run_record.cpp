#include "services/master/record/run_record.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "common/metrics/columns.h"
#include "common/metrics/recorder.h"
#include "common/metrics/run_folder.h"
#include "services/master/record/lives.h"
#include "services/master/record/summary.h"

namespace telesplat::metrics {
namespace {

std::string seconds(double v) { return fmt::format("{:.9f}", v); }
// Returns all digits of a number: displayed frames are made again from poses and times.
std::string exact(double v) { return fmt::format("{}", v); }

struct TileRow {
  const std::string& sampler;
  const wire::TileDone& tile;
  double begin_s;  // the run's begin, on the master's clock

  // Returns seconds since the run's begin; empty: it did not happen.
  std::string moment(double master_s) const { return master_s > 0 ? seconds(master_s - begin_s) : ""; }
};
constexpr Column<TileRow, std::string> kTileColumns[] = {
    {"frame", [](const TileRow& r) { return whole_cell(r.tile.frame.value); }},
    {"tile", [](const TileRow& r) { return whole_cell(r.tile.tile); }},
    {"lease", [](const TileRow& r) { return whole_cell(r.tile.lease.value); }},
    {"sampler", [](const TileRow& r) { return csv_cell(r.sampler); }},
    {"samples", [](const TileRow& r) { return whole_cell(r.tile.samples); }},
    {"kept", [](const TileRow& r) { return whole_cell(r.tile.kept); }},
    {"bytes_sampled", [](const TileRow& r) { return whole_cell(r.tile.bytes_sampled); }},
    {"bytes_sent", [](const TileRow& r) { return whole_cell(r.tile.bytes_sent); }},
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
    {"step", [](const TileRow& r) { return whole_cell(r.tile.step); }},
    {"rays", [](const TileRow& r) { return whole_cell(r.tile.rays); }},
    {"extra", [](const TileRow& r) { return whole_cell(r.tile.extra); }},
    {"request", [](const TileRow& r) { return r.tile.request.value ? whole_cell(r.tile.request.value) : ""; }},
    {"requested_s", [](const TileRow& r) { return r.moment(r.tile.moments.requested_s); }},
    {"received_s", [](const TileRow& r) { return r.moment(r.tile.moments.received_s); }},
    {"begun_s", [](const TileRow& r) { return r.moment(r.tile.moments.begun_s); }},
    {"planned_s", [](const TileRow& r) { return r.moment(r.tile.moments.planned_s); }},
    {"lease_arrived_s", [](const TileRow& r) { return r.moment(r.tile.moments.lease_arrived_s); }},
    {"fetch_ms", [](const TileRow& r) { return exact(r.tile.moments.fetch_s * 1e3); }},
    {"arrived_s", [](const TileRow& r) { return r.moment(r.tile.moments.arrived_s); }},
    {"depth_error_m", [](const TileRow& r) { return exact(r.tile.depth_error_m); }},
    {"normal_error_deg", [](const TileRow& r) { return exact(r.tile.normal_error_deg); }},
    {"colour_error", [](const TileRow& r) { return exact(r.tile.colour_error); }},
};

bool is_time(const std::string& column) { return column.ends_with("_s"); }
bool is_moment(const std::string& column) { return is_time(column) && column != "t_s"; }

// Returns a cell of a viewer's table. Moments count from the run's begin.
std::string cell_of(const std::string& column, double value, double begin_s) {
  if (is_moment(column)) return seconds(value - begin_s);
  if ((column == "display_ms" || column == "motion_to_photon_ms") && value < 0) return "";  // it did not happen
  return is_time(column) ? seconds(value) : exact(value);
}

// The first columns of epochs.csv; the scene's parameters and texts follow.
struct EpochRow {
  EpochId epoch;
  double t_s;
};
constexpr Column<EpochRow, std::string> kEpochColumns[] = {
    {"epoch", [](const EpochRow& r) { return whole_cell(r.epoch.value); }},
    {"t_s", [](const EpochRow& r) { return seconds(r.t_s); }},
};

constexpr Column<Assignment, std::string> kAssignmentColumns[] = {
    {"partition", [](const Assignment& a) { return whole_cell(a.partition); }},
    {"round", [](const Assignment& a) { return whole_cell(a.round); }},
    {"data_server", [](const Assignment& a) { return csv_quoted(a.data_server); }},
    {"sampler", [](const Assignment& a) { return csv_quoted(a.sampler); }},
    {"begin", [](const Assignment& a) { return whole_cell(a.begin); }},
    {"end", [](const Assignment& a) { return whole_cell(a.end); }},
    {"bytes", [](const Assignment& a) { return whole_cell(a.bytes); }},
};

template <class V>
std::vector<std::string> keys(const std::map<std::string, V>& map) {
  std::vector<std::string> out;
  for (const auto& [key, value] : map) out.push_back(key);
  return out;
}

constexpr const char* kTrace = "trace.json";
constexpr const char* kRoom = ".room";
constexpr off_t kRoomBytes = 1 << 20;

Error cannot_write(const std::string& path) {
  return Error{fmt::format("{}: cannot write into it: {}", path, std::strerror(errno))};
}

// Returns the system's text, which ends such an error.
std::string reason_of(const Error& error) { return error.text.substr(error.text.rfind(": ") + 2); }

void append(std::vector<std::string>& cells, const std::vector<std::string>& more) {
  cells.insert(cells.end(), more.begin(), more.end());
}

}  // namespace

Result<std::unique_ptr<RunRecord>> RunRecord::open(const std::string& directory, const Beginning& begin,
                                                   const RecordOptions& options) {
  std::unique_ptr<RunRecord> out(new RunRecord(directory, options));
  out->begin_ = begin;
  out->lives_.push_back({begin, clock_id()});
  if (directory.empty()) return out;
  if (const auto error = make_private_folder(directory))
    return Error{fmt::format("{}: cannot be made a run folder: {}", directory, error.message())};
  if (const Status opened = options.goes_on ? out->go_on() : out->open_files(); !opened) return opened.error();
  out->keep_room();
  return out;
}

RunRecord::~RunRecord() {
  if (!directory_.empty()) unlink(path_of(kRoom).c_str());
}

// Reserves room on the disk, so that the summary fits even if the disk is full.
void RunRecord::keep_room() {
  const int fd = ::open(path_of(kRoom).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kPrivate);
  if (fd < 0) return;
  if (posix_fallocate(fd, 0, kRoomBytes) != 0) log::warn("{}: little room is left on its disk", directory_);
  close(fd);
}

Status RunRecord::open_files() {
  for (const Csv csv : {Csv::kFrames, Csv::kUpdates, Csv::kStages, Csv::kTiles, Csv::kEpochs})
    if (!file(csv).open(path_of(file_of(csv)), options_.table_bytes)) return cannot_write(directory_);
  if (!trace_.open(path_of(kTrace), begin_.monotonic_s, options_.trace_bytes) || !lives_file_.open(path_of(kLivesFile)))
    return cannot_write(directory_);
  file(Csv::kTiles).write(csv_line(names(kTileColumns)));
  lives_file_.write(lives_header());
  return begin_life();
}

// Continues the files behind their last whole rows.
Status RunRecord::go_on() {
  auto before = read_lives(directory_);
  if (!before) return before.error();
  Life now = lives_.back();
  lives_ = *std::move(before);
  begin_ = continued(lives_.front(), now);
  for (size_t i = 0; i < kCsvs; ++i) {
    const std::string path = path_of(file_of(Csv(i)));
    now.bytes[i] = whole_rows(path);
    if (now.bytes[i] == 0 && (Csv(i) == Csv::kPlans || Csv(i) == Csv::kAssignment)) continue;  // it has no rows
    if (!files_[i].open_behind(path, now.bytes[i], options_.table_bytes)) return cannot_write(directory_);
  }
  if (now.bytes[size_t(Csv::kTiles)] == 0) file(Csv::kTiles).write(csv_line(names(kTileColumns)));
  for (const auto& [csv, table] :
       {std::pair{Csv::kFrames, "frames"}, {Csv::kUpdates, "updates"}, {Csv::kStages, "stages"}})
    if (auto columns = header_of(path_of(file_of(csv))); columns.size() > 1)
      measured_.table(table)->columns.assign(columns.begin() + 1, columns.end());
  if (auto columns = header_of(path_of(file_of(Csv::kEpochs))); columns.size() >= std::size(kEpochColumns))
    epoch_columns_.assign(columns.begin() + std::size(kEpochColumns), columns.end());
  lives_.push_back(now);
  const std::string trace = path_of(kTrace), lives = path_of(kLivesFile);
  if (!trace_.open_behind(trace, begin_.monotonic_s, whole_events(trace), lives_.size(), options_.trace_bytes) ||
      !lives_file_.open_behind(lives, whole_rows(lives)))
    return cannot_write(directory_);
  return begin_life();
}

Status RunRecord::begin_life() {
  lives_file_.write(life_row(lives_.size(), lives_.back(), begin_));
  lives_file_.flush();
  return lives_file_.status();
}

Status RunRecord::add_rows(const Process& process, const wire::MetricRows& rows) {
  if (rows.table == "spans") {
    if (rows.values.size() % kSpanWidth)
      return Error{fmt::format("spans hold {} values, not a multiple of {}", rows.values.size(), kSpanWidth)};
    trace_.add(process, rows);
    flush();
    return ok_status();
  }
  const Table* table = measured_.table(rows.table);
  if (!table) return Error{fmt::format("metrics table '{}' is unknown", to_utf8(rows.table.substr(0, 32)))};
  const bool first = table->columns.empty();
  if (Status added = measured_.add(process.name, rows); !added) return added;
  row_losses_.came(process, rows.table, rows.values.size() / rows.columns.size());
  TextFile& out = file(rows.table == "frames" ? Csv::kFrames : rows.table == "stages" ? Csv::kStages : Csv::kUpdates);
  if (!out.is_open()) return ok_status();
  if (first) {
    std::vector<std::string> header{"viewer"};
    for (const auto& column : rows.columns) header.push_back(csv_cell(column));
    out.write(csv_line(header));
  }
  const std::string name = csv_cell(process.name);
  for (size_t i = 0; i < rows.values.size(); i += rows.columns.size()) {
    std::vector<std::string> cells{name};
    for (size_t c = 0; c < rows.columns.size(); ++c)
      cells.push_back(cell_of(rows.columns[c], rows.values[i + c], begin_.monotonic_s));
    out.write(csv_line(cells));
  }
  flush();
  return ok_status();
}

// Called as rows come, once a second from viewers and samplers: a master that is killed loses little more than that.
void RunRecord::flush() {
  for (TextFile& file : files_) file.flush();
  trace_.file().flush();
}

void RunRecord::add_status(const Process& process) {
  for (const auto& [value, table] : {std::pair{kUpdateRows, "updates"}, {kStageRows, "stages"}})
    if (const auto sent = process.values.find(value); sent != process.values.end())
      row_losses_.told(process, table, sent->second);
}

void RunRecord::add_tile(const std::string& sampler, const wire::TileDone& tile) {
  measured_.tiles().add(sampler, tile);
  trace_.add_lease(sampler, tile);
  if (file(Csv::kTiles).is_open())
    file(Csv::kTiles).write(csv_line(values(kTileColumns, TileRow{sampler, tile, begin_.monotonic_s})));
}

void RunRecord::add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                          const std::map<std::string, std::string>& texts) {
  TextFile& out = file(Csv::kEpochs);
  const bool first = measured_.epochs() == 0 && lives_.back().bytes[size_t(Csv::kEpochs)] == 0;
  measured_.add_epoch();
  if (first) {
    epoch_columns_ = keys(parameters);
    append(epoch_columns_, keys(texts));
    std::vector<std::string> header = names(kEpochColumns);
    for (const auto& column : epoch_columns_) header.push_back(csv_cell(column));
    out.write(csv_line(header));
  }
  std::vector<std::string> cells = values(kEpochColumns, EpochRow{epoch, t_s - begin_.monotonic_s});
  for (const std::string& name : epoch_columns_) {
    const auto number = parameters.find(name);
    const auto text = texts.find(name);
    if (number != parameters.end())
      cells.push_back(exact(number->second));  // the frame can be made again from it
    else
      cells.push_back(text == texts.end() ? "" : csv_quoted(text->second));
  }
  out.write(csv_line(cells));
  out.flush();
}

// Opens a table at its first row. False: it cannot be opened, which counts as a file that could not be written.
bool RunRecord::open_late(Csv csv, const std::vector<std::string>& columns) {
  if (file(csv).is_open()) return true;
  if (!file(csv).open(path_of(file_of(csv)), options_.table_bytes)) {
    if (std::find(unwritten_.begin(), unwritten_.end(), file_of(csv)) == unwritten_.end()) {
      const Error error = cannot_write(path_of(file_of(csv)));
      unwritten_.push_back(file_of(csv));
      why_ = reason_of(error);
      log::error("{}; the run goes on without it", error.text);
    }
    return false;
  }
  file(csv).write(csv_line(columns));
  return true;
}

void RunRecord::add_assignment(const std::vector<Assignment>& transfers) {
  if (directory_.empty() || !open_late(Csv::kAssignment, names(kAssignmentColumns))) return;
  for (const Assignment& a : transfers) file(Csv::kAssignment).write(csv_line(values(kAssignmentColumns, a)));
  file(Csv::kAssignment).flush();
}

void RunRecord::add_plan(const std::string& viewer, const PlanRow& plan) {
  measured_.tiles().add(plan);
  trace_.add_plan(viewer, plan);
  if (directory_.empty() || !open_late(Csv::kPlans, plan_columns())) return;
  file(Csv::kPlans).write(csv_line(plan_cells(viewer, plan, begin_.monotonic_s)));
}

RecordLosses RunRecord::losses() const {
  RecordLosses out{.failed = unwritten_, .why = why_, .lost = {}, .cut = {}};
  const auto look = [&out](const TextFile& file) {
    const std::string name = file.path().substr(file.path().rfind('/') + 1);
    if (!file.status()) out.failed.push_back(name), out.why = reason_of(file.status().error());
    if (file.rows_lost() > 0) out.lost[name] = file.rows_lost();
    if (file.rows_cut() > 0) out.cut[name] = file.rows_cut();
  };
  for (const TextFile& file : files_) look(file);
  for (const auto& [table, rows] : row_losses_.lost()) out.lost[table + ".csv"] += rows;
  look(lives_file_);
  look(trace_.file());
  return out;
}

nlohmann::ordered_json RunRecord::summary(const std::vector<Process>& processes,
                                          const std::map<std::string, double>& counters, About about) const {
  about.begin = begin_;
  about.lives = lives_.size();
  about.losses = losses();
  return summarise(measured_, processes, counters, about);
}

Status RunRecord::write_file(const std::string& name, const std::string& text) {
  if (directory_.empty()) return ok_status();
  unlink(path_of(kRoom).c_str());
  Status written = write_whole(path_of(name), text, kPrivate);
  if (!written) unwritten_.push_back(name), why_ = reason_of(written.error());
  return written;
}

Status RunRecord::finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                         const About& about) {
  if (directory_.empty()) return ok_status();
  for (TextFile& file : files_) file.close();
  trace_.close();
  if (lives() > 1) measured_ = read_back(directory_, lives_);
  const auto text =
      summary(processes, counters, about).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  const Status written = write_file("summary.json", text);
  if (written && measured_.frames().rows > 0) point_latest(directory_);
  const RecordLosses lost = losses();
  if (lost.failed.empty()) return ok_status();
  return Error{fmt::format("{}: not all of the record could be written: {}: {}", directory_,
                           fmt::join(lost.failed, ", "), lost.why)};
}

}  // namespace telesplat::metrics
