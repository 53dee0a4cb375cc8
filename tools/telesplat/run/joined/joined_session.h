// Prints for a person who joins a session what it lacks, and that it shows another data set than the one named.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/net/connections/waiting.h"

namespace telesplat::launcher {

class JoinedSession {
 public:
  /// named: the data set of the command line; may be empty.
  JoinedSession(std::string master, std::string named);

  /// status: the master's newest answer, or null. nobody_there: no process accepts connections at its address. refusal:
  /// its reason for refusing this person; empty: it did not refuse. Returns the lines that are due.
  std::vector<std::string> look(const nlohmann::json* status, bool nobody_there, const std::string& refusal,
                                double now_s);

 private:
  std::string awaited(bool nobody_there, const std::string& refusal, double now_s);

  const std::string master_;
  std::string named_;  // reset once it is compared with the shown one
  std::string lacks_;
  std::optional<double> heard_s_;
  net::Waiting waiting_;
  net::HostSearch host_;
};

}  // namespace telesplat::launcher
