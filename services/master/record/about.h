// What was run, where and when, and who took part: the part of a record that is not measured.
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

/// "2026-01-31T14:25:00.123456789+01:00", in this machine's time zone.
std::string iso_time(int64_t unix_ns);

/// What a record lacks. rows: by file.
struct RecordLosses {
  std::vector<std::string> failed;       ///< files that could not be written to their end
  std::string why;                       ///< what the system said of one of them: "No space left on device"
  std::map<std::string, uint64_t> lost;  ///< their rows
  std::map<std::string, uint64_t> cut;   ///< rows beyond the limit of a file
};

/// What was run, where and when: the part of a record that is not measured.
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

/// The keys of summary.json that say what was done: version, begin, machines, command, data, trajectory, ... Nothing is
/// measured; what nobody told is null.
nlohmann::ordered_json what_was_done(const About& about, const std::vector<Process>& processes);

/// Looks into a list of processes; holds a reference to it. A process that was replaced lives on in the one that took
/// its place: what is counted adds up over both, what is there now is what the living hold.
class Roster {
 public:
  explicit Roster(const std::vector<Process>& processes) : processes_(processes) {}

  /// Processes of a role, each life but the last left out.
  size_t count(const std::string& role) const;
  /// Lives of a role that ended without a goodbye.
  size_t lost(const std::string& role) const;
  /// What the first of a role that has this fact says, of viewers the one that records into the session's own folder;
  /// empty if none does.
  std::string fact(const std::string& role, const std::string& key) const;
  /// The same as a number; 0 if none does.
  double number(const std::string& role, const std::string& key) const;
  /// A status value, summed over all lives of a role, or of all roles if `role` is empty.
  double counted(const std::string& role, const std::string& key) const;
  /// The same without those that were replaced.
  double present(const std::string& role, const std::string& key) const;
  /// A status value of each process of a role that has it.
  std::vector<double> each(const std::string& role, const std::string& key) const;

 private:
  const std::vector<Process>& processes_;
};

}  // namespace telesplat::metrics
