// A process as the record of a run knows it.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace telesplat::metrics {

/// Status value by which a process tells how many files of the record it could not write to their end.
inline constexpr const char* kRecordFailed = "record_failed";

/// Status values by which a viewer tells how many rows of updates.csv and stages.csv it has sent.
inline constexpr const char *kUpdateRows = "update_rows", *kStageRows = "stage_rows";

/// Facts by which processes tell the record what the figures do not: tables of session.toml, "\n[table]\nkey = ...\n".
inline constexpr const char* kRecordFact = "record";

struct Process {
  std::string role, name;
  uint64_t pid = 0;
  std::map<std::string, std::string> facts;
  std::map<std::string, double> values;  ///< newest status report
  bool replaced = false;                 ///< it died and another of its name took its place
  bool lost = false;                     ///< it ended without a goodbye
};

}  // namespace telesplat::metrics
