// The record of a run (DESIGN section 6): frames.csv, updates.csv, tiles.csv, epochs.csv, trace.json, summary.json in one folder. Written by
// the master as rows arrive, so that what was measured survives whatever ends the run.
#pragma once

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/metrics/statistics.h"
#include "common/wire/messages.h"

namespace telesplat::metrics {

/// A process as the record knows it.
struct Process {
  std::string role, name;
  uint64_t pid = 0;
  std::map<std::string, std::string> facts;
  std::map<std::string, double> values;  ///< newest status report
  bool replaced = false;                 ///< it died and another of its name took its place
};

/// A row of assignment.csv: a transfer of a partition's assignment sheet (T5.3).
struct Assignment {
  uint64_t partition = 0, round = 0;
  std::string data_server, sampler;
  uint64_t begin = 0, end = 0;  ///< slices
  uint64_t bytes = 0;           ///< expected
};

class RunRecord {
 public:
  /// Opens a folder for writing, making it if need be; `directory` may be empty: nothing is written, summaries still work.
  static Result<std::unique_ptr<RunRecord>> open(const std::string& directory);
  ~RunRecord();

  /// Rows of "frames", "updates" or "spans" from `process`. Refuses unknown tables and shapes that do not fit.
  Status add_rows(const Process& process, const wire::MetricRows& rows);
  void add_tile(const std::string& sampler, const wire::TileDone& tile);
  /// The scene's parameters and texts (quoted in the file) from t_s on. epochs.csv has the names of the first epoch.
  void add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                 const std::map<std::string, std::string>& texts = {});
  void add_assignment(const std::vector<Assignment>& transfers);

  /// The summary of DESIGN section 6 from everything so far. processes: all that took part; counters: "leases_expired",
  /// "tiles_released".
  nlohmann::ordered_json summary(const std::vector<Process>& processes,
                                 const std::map<std::string, double>& counters) const;

  /// Writes summary.json and ends trace.json.
  Status finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters);

 private:
  struct Table {
    std::vector<std::string> columns;
    std::vector<double> values;
    std::vector<uint32_t> viewers;  // of each row: whose, in viewers_
    FILE* file = nullptr;
  };
  /// What one viewer did.
  struct ViewerFigures {
    size_t frames = 0, updates = 0;
    double duration_s = 0;
    std::vector<double> inter_frame_ms, latency_ms;
  };
  RunRecord() = default;
  std::vector<double> column(const std::string& table, const std::string& name) const;
  std::map<std::string, ViewerFigures> by_viewer() const;
  Status write_row_table(const std::string& process, const wire::MetricRows& rows);
  void write_spans(const Process& process, const wire::MetricRows& rows);

  std::string directory_;
  std::map<std::string, Table> tables_;
  std::vector<std::string> viewers_;
  std::vector<wire::TileDone> tiles_;
  std::map<std::string, double> busy_s_;  // sample begin to encode end, by sampler
  std::vector<std::string> epoch_columns_, epoch_texts_;
  size_t epochs_ = 0;
  FILE* tiles_file_ = nullptr;
  FILE* epochs_file_ = nullptr;
  FILE* assignment_file_ = nullptr;  // volumes have one
  FILE* trace_file_ = nullptr;
  bool trace_has_events_ = false;
  std::map<std::string, int> trace_names_;
};

}  // namespace telesplat::metrics
