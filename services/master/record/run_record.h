// The record of a run: frames.csv, updates.csv, stages.csv, tiles.csv, plans.csv, epochs.csv, assignment.csv,
// trace.json, lives.csv and summary.json in one folder (docs/metrics.md lists every column and figure). The master
// writes it as rows arrive: they survive, however the run ends. A full disk does not end the run; it is logged and
// reported.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/metrics/process.h"
#include "services/master/record/about.h"
#include "services/master/record/lives.h"
#include "services/master/record/measured.h"
#include "services/master/record/text_file.h"
#include "services/master/record/trace_file.h"

namespace telesplat::metrics {

/// A row of assignment.csv: a transfer of a partition's assignment sheet (T5.3).
struct Assignment {
  uint64_t partition = 0, round = 0;
  std::string data_server, sampler;
  uint64_t begin = 0, end = 0;  ///< slices
  uint64_t bytes = 0;           ///< expected
};

struct RecordOptions {
  uint64_t table_bytes = 0;  ///< size of a table's file at most; 0: no limit
  uint64_t trace_bytes = 0;  ///< size of trace.json at most; 0: no limit
  bool goes_on = false;      ///< continues the record that another master left in the folder
};

/// Counts rows of viewers that never reached the record: rows that they report as sent, less rows that came. For
/// frames.csv, frame numbers show the losses (Measured).
class RowLosses {
 public:
  static constexpr size_t kMostKept = 512;  ///< pairs of viewer and table; losses of further ones are not known
  static constexpr double kMostLost = 1e6;  ///< rows at once: after a larger step the viewer counts anew

  void came(const Process& viewer, const std::string& table, uint64_t rows) {
    if (Rows* r = rows_of(viewer, table)) r->came += double(rows);
  }
  /// sent: rows that it sent over this connection in its life, before this report. The first report sets the base: rows
  /// that were missing by then belong to another record.
  void told(const Process& viewer, const std::string& table, double sent) {
    Rows* r = rows_of(viewer, table);
    if (!r || !(sent >= 0)) return;
    const double missing = sent - r->came, more = missing - r->missing.value_or(missing);
    if (more > 0 && more <= kMostLost) lost_[table] += uint64_t(more);
    r->missing = missing;
  }
  /// By table.
  const std::map<std::string, uint64_t>& lost() const { return lost_; }

 private:
  struct Rows {
    uint64_t pid = 0;
    double came = 0;
    std::optional<double> missing;  // by its last report
  };
  Rows* rows_of(const Process& viewer, const std::string& table) {
    const std::pair key(viewer.name, table);
    if (rows_.size() >= kMostKept && !rows_.contains(key)) return nullptr;
    Rows& out = rows_[key];
    if (out.pid != viewer.pid) out = {viewer.pid, 0, {}};
    return &out;
  }

  std::map<std::pair<std::string, std::string>, Rows> rows_;
  std::map<std::string, uint64_t> lost_;
};

class RunRecord {
 public:
  /// Opens a folder for writing, and makes it if need be. `directory` may be empty: nothing is written, summaries still
  /// work. begin: times of all files, which come on the master's clock, count from it; in a record that goes on,
  /// from its first begin.
  static Result<std::unique_ptr<RunRecord>> open(const std::string& directory, const Beginning& begin = {},
                                                 const RecordOptions& options = {});
  ~RunRecord();

  /// Rows of "frames", "updates", "stages" or "spans" from `process`. Error: unknown table, or a shape that does not
  /// fit. Columns whose names end in _s are moments on the master's clock, except t_s, which each viewer counts from
  /// its own begin.
  Status add_rows(const Process& process, const wire::MetricRows& rows);
  /// Takes the process' report of rows that it sent: rows that did not come are lost.
  void add_status(const Process& process);
  void add_tile(const std::string& sampler, const wire::TileDone& tile);
  /// Adds the scene's parameters and texts (quoted in the file) from t_s on. epochs.csv has the first epoch's names.
  void add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                 const std::map<std::string, std::string>& texts = {});
  void add_assignment(const std::vector<Assignment>& transfers);
  /// viewer: name of the one that asked for the view.
  void add_plan(const std::string& viewer, const PlanRow& plan);

  /// The figures of docs/metrics.md, "summary.json", from everything so far. processes: all that took part; counters:
  /// the master's ("leases_expired", "tiles_released", ...); about: the run; its begin, lives and losses are filled in.
  nlohmann::ordered_json summary(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                                 About about = {}) const;

  /// Writes another file of the record as a whole. Error: it cannot be written, which is counted.
  Status write_file(const std::string& name, const std::string& text);

  /// Writes summary.json. If something was displayed, runs/latest is this run from now on. Error: something could not
  /// be written, now or before.
  Status finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                const About& about = {});
  const Beginning& begin() const { return begin_; }
  /// Number of masters that wrote the record so far, with this one.
  size_t lives() const { return lives_.size(); }
  RecordLosses losses() const;

 private:
  explicit RunRecord(std::string directory, const RecordOptions& options)
      : directory_(std::move(directory)), options_(options) {}
  Status open_files();
  Status go_on();
  Status begin_life();
  bool open_late(Csv csv, const std::vector<std::string>& columns);
  std::string path_of(const std::string& name) const { return directory_ + "/" + name; }
  TextFile& file(Csv csv) { return files_[size_t(csv)]; }
  void keep_room();
  void flush();

  std::string directory_;
  RecordOptions options_;
  Beginning begin_;
  std::vector<Life> lives_;
  Measured measured_;
  RowLosses row_losses_;
  std::vector<std::string> epoch_columns_;
  std::array<TextFile, kCsvs> files_;  // plans.csv and assignment.csv are opened when there is something to write
  TextFile lives_file_;
  TraceFile trace_;
  std::vector<std::string> unwritten_;  // other files
  std::string why_;                     // the system's text for the last of them
};

}  // namespace telesplat::metrics
