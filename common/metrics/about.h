// What was run, where and when: the part of a record that is not measured.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/metrics/beginning.h"
#include "common/metrics/process.h"

namespace telesplat::metrics {

/// What a record lacks. rows: by file.
struct RecordLosses {
  std::vector<std::string> failed;       ///< files that could not be written to their end
  std::string why;                       ///< what the system said of one of them: "No space left on device"
  std::map<std::string, uint64_t> lost;  ///< their rows
  std::map<std::string, uint64_t> cut;   ///< rows beyond the limit of a file
};

struct About {
  std::string id;       ///< the run's own, as in its folder's run.id; empty: none
  std::string version;  ///< of the master's program; empty: unknown
  Beginning begin;
  int64_t end_unix_ns = 0;                 ///< 0: it goes on
  std::map<std::string, double> settings;  ///< of the session, as everyone was told them
  size_t lives = 1;                        ///< masters that wrote the record, one after the other
  RecordLosses losses;
  std::string label;  ///< what reports call the run; empty: its folder's name
};

/// Facts by which processes tell the record what the figures do not: tables of session.toml, "\n[table]\nkey = ...\n".
inline constexpr const char* kRecordFact = "record";

/// The keys of summary.json that say what was done: version, begin, machines, command, data, trajectory, ... Nothing is
/// measured; what nobody told is null.
nlohmann::ordered_json what_was_done(const About& about, const std::vector<Process>& processes);

}  // namespace telesplat::metrics
