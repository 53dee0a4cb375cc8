// Who took part in a run, and what they said of themselves.
#pragma once

#include <string>
#include <vector>

#include "common/metrics/process.h"

namespace telesplat::metrics {

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
