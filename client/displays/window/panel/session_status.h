// Data that pass between the panel and a session's master: orders, which are commands of `telesplat ctl`; the
// processes, as in `telesplat ctl status`; and missing services.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::viewer {

/// An order of the panel to a session's master: a command of `telesplat ctl`.
struct Order {
  std::string command;  ///< wire::Control
  std::map<std::string, std::string> arguments;
  /// A later order of the same subject replaces one that waits: a dragged slider gives many orders. Empty: it replaces
  /// no order.
  std::string subject;
  bool operator==(const Order&) const = default;
};

struct OrderAnswer {
  Order order;
  bool obeyed = false;
  std::string text;  ///< the master's answer, or why there is no answer; a line for the person
};

struct SessionStatus {
  struct Process {
    std::string role, name;
    bool alive = true;
    double silent_s = 0;  ///< since its last message
    bool operator==(const Process&) const = default;
  };
  std::vector<Process> processes;
  std::string animation;  ///< the timeline that plays; empty: no timeline plays
  bool operator==(const SessionStatus&) const = default;
};

/// Reads the master's JSON. Error: it is not a status. Unknown parts are left out.
Result<SessionStatus> read_status(const std::string& json);

/// Returns a line for each necessary service that is missing or has been silent for long; empty: all are here.
std::vector<std::string> missing_services(const SessionStatus& status);

}  // namespace telesplat::viewer
