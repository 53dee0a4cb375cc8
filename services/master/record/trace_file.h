// trace.json: the work of each process over time, in Chrome's trace format (docs/metrics.md).
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

/// A JSON list that grows event by event and ends when this object does.
class TraceFile {
 public:
  ~TraceFile() { close(); }
  /// begin_s: on the master's clock; times in the file count from there. limit_bytes: as TextFile::open().
  bool open(const std::string& path, double begin_s, uint64_t limit_bytes = 0);
  /// Likewise, but goes on behind the file's first keep_bytes bytes (whole_events()). life: number of this life of the
  /// record, from 2 on, which distinguishes its processes from those of earlier lives.
  bool open_behind(const std::string& path, double begin_s, uint64_t keep_bytes, size_t life, uint64_t limit_bytes = 0);
  /// Adds rows of "spans" (recorder.h). Leaves out rows whose name is not among the columns. Precondition: kSpanWidth
  /// values a row.
  void add(const Process& process, const wire::MetricRows& rows);
  /// Adds the master's span of a tile: from its lease until the packer had it.
  void add_lease(const std::string& sampler, const wire::TileDone& tile);
  /// Adds the master's span of a plan: from the question to the answer.
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
  int first_number_ = 1;                  // number of this life's first process
  std::map<std::string, int> processes_;  // numbers of processes whose names the file has
  std::set<std::pair<int, int>> lanes_;   // lanes whose names the file has
  uint64_t span_ = 0;                     // id of the last span that may overlap others
};

}  // namespace telesplat::metrics
