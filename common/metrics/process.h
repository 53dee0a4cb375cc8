// A process in the record of a run.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace telesplat::metrics {

/// Status value with which a process reports the number of record files that it could not write completely.
inline constexpr const char* kRecordFailed = "record_failed";

/// Status values with which a viewer reports the number of rows of updates.csv and stages.csv that it has sent.
inline constexpr const char *kUpdateRows = "update_rows", *kStageRows = "stage_rows";

/// Fact with which a process adds text to the record: tables of session.toml, " [table] key = ... ".
inline constexpr const char* kRecordFact = "record";

struct Process {
  std::string role, name;
  uint64_t pid = 0;
  std::map<std::string, std::string> facts;
  std::map<std::string, double> values;  ///< newest status report
  bool replaced = false;                 ///< it died, and another process of its name took its place
  bool lost = false;                     ///< it ended without a goodbye
};

}  // namespace telesplat::metrics
