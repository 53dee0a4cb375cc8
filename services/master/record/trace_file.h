// trace.json: who did what when, in Chrome's trace format (docs/metrics.md).
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <utility>

#include "common/metrics/process.h"
#include "common/wire/session_messages.h"
#include "services/master/record/plan_row.h"
#include "services/master/record/text_file.h"

namespace telesplat::metrics {

/// A JSON list that grows event by event and ends when this does.
class TraceFile {
 public:
  ~TraceFile() { close(); }
  /// begin_s: on the master's clock; times in the file count from there. limit_bytes: as TextFile::open().
  bool open(const std::string& path, double begin_s, uint64_t limit_bytes = 0);
  /// The same, but goes on behind the first keep_bytes of what is there (whole_events()). life: of the record, from 2
  /// on: its processes are told apart from those of lives before.
  bool open_behind(const std::string& path, double begin_s, uint64_t keep_bytes, size_t life, uint64_t limit_bytes = 0);
  /// Rows of "spans" (recorder.h). Rows whose name is not among the columns are left out. Precondition: kSpanWidth
  /// values a row.
  void add(const Process& process, const wire::MetricRows& rows);
  /// What the master had of a tile: its lease, until the packer had it.
  void add_lease(const std::string& sampler, const wire::TileDone& tile);
  /// And of a plan: from the question to the answer.
  void add_plan(const std::string& viewer, const PlanRow& plan);
  /// Ends the list.
  void close();
  TextFile& file() { return file_; }
  const TextFile& file() const { return file_; }

 private:
  void event(const nlohmann::json& json);
  int number_of(const std::string& process, const std::string& role, uint64_t pid);
  void name_lane(int process, const std::string& role, int lane);
  void overlapping(int process, const std::string& name, const std::string& category, double begin_s, double end_s,
                   nlohmann::json args);

  TextFile file_;
  double begin_s_ = 0;
  bool has_events_ = false;
  int first_number_ = 1;                  // of this life's processes
  std::map<std::string, int> processes_;  // numbers of those whose names the file has
  std::set<std::pair<int, int>> lanes_;   // that have names
  uint64_t span_ = 0;                     // of those that may overlap: the last one's id
};

}  // namespace telesplat::metrics
