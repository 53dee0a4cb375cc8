// Who takes part in a session, as its master tells it to `telesplat ctl status`, and what is missing.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

struct SessionStatus {
  struct Process {
    std::string role, name;
    bool alive = true;
    double silent_s = 0;  ///< since its last message
    bool operator==(const Process&) const = default;
  };
  std::vector<Process> processes;
  std::string animation;  ///< the timeline that plays; empty: none
  bool operator==(const SessionStatus&) const = default;
};

/// Reads the master's JSON. Error: it is no status. What is strange in it is left out.
Result<SessionStatus> read_status(const std::string& json);

/// A line for each service that nothing can be shown without and that is not here or has been silent for long; empty:
/// all are here.
std::vector<std::string> missing_services(const SessionStatus& status);

}  // namespace telesplat::viewer
