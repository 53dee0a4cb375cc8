// What passes between the panel and a session's master: orders, which are the commands of `telesplat ctl`, and who
// takes part, as `telesplat ctl status` has it, and what is missing.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

/// What the panel orders of a session's master: the commands of `telesplat ctl`.
struct Order {
  std::string command;  ///< wire::Control
  std::map<std::string, std::string> arguments;
  /// A later order of the same subject replaces one that waits: a slider that is dragged orders often. Empty: it
  /// replaces none.
  std::string subject;
  bool operator==(const Order&) const = default;
};

struct OrderAnswer {
  Order order;
  bool obeyed = false;
  std::string text;  ///< what the master said, or why it said nothing; a line for the person
};

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
