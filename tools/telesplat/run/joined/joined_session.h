// Tells a person who joins a session what it lacks, and that it shows another data set than the one that was named.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/net/connections/waiting.h"

namespace telesplat::launcher {

class JoinedSession {
 public:
  /// named: the data set of the command line; empty: none.
  JoinedSession(std::string master, std::string named);

  /// status: an answer of the master that has just come, or null. nobody_there: nothing takes connections at its
  /// address. refusal: why it does not take this person in; empty: it did not refuse. Returns the lines that are due.
  std::vector<std::string> look(const nlohmann::json* status, bool nobody_there, const std::string& refusal,
                                double now_s);

 private:
  std::string awaited(bool nobody_there, const std::string& refusal, double now_s);

  const std::string master_;
  std::string named_;  // until it is compared with what is shown
  std::string lacks_;
  std::optional<double> heard_s_;
  net::Waiting waiting_;
  net::HostSearch host_;
};

}  // namespace telesplat::launcher
