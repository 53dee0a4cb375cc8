// trace.json: who did what when, in Chrome's trace format (docs/metrics.md).
#pragma once

#include <set>
#include <string>

#include "common/metrics/process.h"
#include "common/metrics/text_file.h"
#include "common/wire/session_messages.h"

namespace telesplat::metrics {

/// A JSON list that grows event by event and ends when this does.
class TraceFile {
 public:
  ~TraceFile();
  /// begin_s: on the master's clock; times in the file count from there.
  bool open(const std::string& path, double begin_s);
  /// Rows of "spans": name (its number among the columns), begin, end (seconds of the master's clock), lane. Rows whose
  /// name is not among the columns are left out. Precondition: 4 values a row.
  void add(const Process& process, const wire::MetricRows& rows);

 private:
  void event(const std::string& json);

  TextFile file_;
  double begin_s_ = 0;
  bool has_events_ = false;
  std::set<std::string> named_;  // processes whose names the file has
};

}  // namespace telesplat::metrics
