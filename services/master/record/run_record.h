// The record of a run: frames.csv, updates.csv, stages.csv, tiles.csv, plans.csv, epochs.csv, assignment.csv,
// trace.json, lives.csv and summary.json in one folder (docs/metrics.md tells every column and figure). The master
// writes it as rows arrive: what was measured survives, however the run ends. A disk that is full ends nothing, and is
// told.
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
  uint64_t table_bytes = 0;  ///< of a table's file at most; 0: no limit
  uint64_t trace_bytes = 0;  ///< of trace.json
  bool goes_on = false;      ///< with the record that another master left in the folder
};

/// Counts rows of viewers that never reached the record: what they say that they have sent, against what came. Of
/// frames.csv the numbers of frames tell it (Measured).
class RowLosses {
 public:
  static constexpr size_t kMostKept = 512;  ///< viewers and tables; of further ones no loss is known
  static constexpr double kMostLost = 1e6;  ///< at once: a larger step is no loss but another count

  void came(const Process& viewer, const std::string& table, uint64_t rows) {
    if (Rows* r = rows_of(viewer, table)) r->came += double(rows);
  }
  /// sent: in its life, before it says this, over the same connection. What a viewer sent before it said so first is
  /// another record's.
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
    std::optional<double> missing;  // as it was told last
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
  /// work. begin: from here on count the times of all files, which come on the master's clock; of a record that goes
  /// on, from where they did before.
  static Result<std::unique_ptr<RunRecord>> open(const std::string& directory, const Beginning& begin = {},
                                                 const RecordOptions& options = {});
  ~RunRecord();

  /// Rows of "frames", "updates", "stages" or "spans" from `process`. Refuses unknown tables and shapes that do not
  /// fit. Columns whose names end in _s are moments of the master's clock; but for t_s, which each viewer counts from
  /// its own.
  Status add_rows(const Process& process, const wire::MetricRows& rows);
  /// What this process says of itself: rows that it has sent and that did not come are lost.
  void add_status(const Process& process);
  void add_tile(const std::string& sampler, const wire::TileDone& tile);
  /// The scene's parameters and texts (quoted in the file) from t_s on. epochs.csv has the names of the first epoch.
  void add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                 const std::map<std::string, std::string>& texts = {});
  void add_assignment(const std::vector<Assignment>& transfers);
  /// viewer: name of the one that asked for the view.
  void add_plan(const std::string& viewer, const PlanRow& plan);

  /// The figures of docs/metrics.md, "summary.json", from everything so far. processes: all that took part; counters:
  /// the master's ("leases_expired", "tiles_released", ...); about: what was done, its beginning left out.
  nlohmann::ordered_json summary(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                                 About about = {}) const;

  /// Another file of the record, written as a whole. Error: it cannot be, which is counted.
  Status write_file(const std::string& name, const std::string& text);

  /// Writes summary.json. If something was displayed, runs/latest is this run from now on. Error: something could not
  /// be written, now or before.
  Status finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                const About& about = {});
  const Beginning& begin() const { return begin_; }
  /// Masters that wrote it so far, this one included.
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
  std::string why_;                     // what the system said of the last of them
};

}  // namespace telesplat::metrics
