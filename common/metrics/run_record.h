// The record of a run: frames.csv, updates.csv, stages.csv, tiles.csv, plans.csv, epochs.csv, assignment.csv,
// trace.json and summary.json in one folder (docs/metrics.md tells every column and figure). The master writes it as
// rows arrive: what was measured survives, however the run ends.
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/metrics/about.h"
#include "common/metrics/measured.h"
#include "common/metrics/process.h"
#include "common/metrics/text_file.h"
#include "common/metrics/trace/trace_file.h"

namespace telesplat::metrics {

/// A row of assignment.csv: a transfer of a partition's assignment sheet (T5.3).
struct Assignment {
  uint64_t partition = 0, round = 0;
  std::string data_server, sampler;
  uint64_t begin = 0, end = 0;  ///< slices
  uint64_t bytes = 0;           ///< expected
};

class RunRecord {
 public:
  /// Opens a folder for writing, and makes it if need be. `directory` may be empty: nothing is written, summaries still
  /// work. begin: from here on count the times of all files, which come on the master's clock.
  static Result<std::unique_ptr<RunRecord>> open(const std::string& directory, const Beginning& begin = {});

  /// Rows of "frames", "updates", "stages" or "spans" from `process`. Refuses unknown tables and shapes that do not
  /// fit. Columns whose names end in _s are moments of the master's clock; but for t_s, which each viewer counts from
  /// its own.
  Status add_rows(const Process& process, const wire::MetricRows& rows);
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

  /// Writes summary.json. If something was displayed, runs/latest is this run from now on.
  Status finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters,
                const About& about = {});
  const Beginning& begin() const { return begin_; }

 private:
  RunRecord() = default;
  Status open_files();
  TextFile& file_of(const std::string& table);

  std::string directory_;
  Beginning begin_;
  Measured measured_;
  std::vector<std::string> epoch_columns_, epoch_texts_;
  TextFile frames_file_, updates_file_, stages_file_, tiles_file_, epochs_file_;
  TextFile assignment_file_, plans_file_;  // opened when there is something to write: the first of volumes alone
  TraceFile trace_;
};

}  // namespace telesplat::metrics
