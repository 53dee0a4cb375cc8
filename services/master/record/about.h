// The part of a record that is not measured: the run, its place and time, and the processes that took part.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/metrics/process.h"

namespace telesplat::metrics {

/// One moment on two clocks.
struct Beginning {
  double monotonic_s = 0;  ///< telesplat::monotonic_s() of the master's machine
  int64_t unix_ns = 0;     ///< nanoseconds since 1970 began, UTC; 0: not known
};
Beginning begin_now();

/// Returns a time as "2026-01-31T14:25:00.123456789+01:00", in this machine's time zone.
std::string iso_time(int64_t unix_ns);

/// Losses of a record. Rows are counted by file.
struct RecordLosses {
  std::vector<std::string> failed;       ///< files that could not be written to their end
  std::string why;                       ///< the system's text for one of them: "No space left on device"
  std::map<std::string, uint64_t> lost;  ///< rows that could not be written or never came
  std::map<std::string, uint64_t> cut;   ///< rows beyond the limit of a file
};

/// The run, and when it was: the part of a record that is not measured.
struct About {
  std::string id;       ///< id of the run, as in its folder's run.id; empty: no folder
  std::string version;  ///< version of the master's program; empty: unknown
  Beginning begin;
  int64_t end_unix_ns = 0;                 ///< 0: it goes on
  std::map<std::string, double> settings;  ///< the session's, as all processes got them
  size_t lives = 1;                        ///< masters that wrote the record, one after the other
  RecordLosses losses;
  std::string label;  ///< name of the run in reports; empty: its folder's name
};

/// Returns the keys of summary.json that describe the run: version, begin, machines, command, data, trajectory, ...
/// They are not measured; null: no process reported it.
nlohmann::ordered_json what_was_done(const About& about, const std::vector<Process>& processes);

/// Looks into a list of processes; holds a reference to it. A process that was replaced lives on in the one that took
/// its place: counts add up over both, states are those of the newest life.
class Roster {
 public:
  explicit Roster(const std::vector<Process>& processes) : processes_(processes) {}

  /// Number of processes of a role; several lives of a process are one.
  size_t count(const std::string& role) const;
  /// Number of lives of a role that ended without a goodbye.
  size_t lost(const std::string& role) const;
  /// Returns this fact of the first process of a role that has it, or of the viewer that records into the session's own
  /// folder; empty if no process has it.
  std::string fact(const std::string& role, const std::string& key) const;
  /// Likewise, as a number; 0 if no process has it.
  double number(const std::string& role, const std::string& key) const;
  /// A status value, summed over all lives of a role, or of all roles if `role` is empty.
  double counted(const std::string& role, const std::string& key) const;
  /// Likewise, without lives that were replaced.
  double present(const std::string& role, const std::string& key) const;
  /// A status value of each process of a role that has it.
  std::vector<double> each(const std::string& role, const std::string& key) const;

 private:
  const std::vector<Process>& processes_;
};

}  // namespace telesplat::metrics
