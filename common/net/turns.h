// The loop of a process, cut where it waits: a simulation of whole sessions runs many processes in one, turn by turn.
#pragma once

#include <optional>
#include <vector>

#include "common/net/socket.h"

namespace telesplat::net {

/// Condition that a process waits for between two turns.
struct Wait {
  std::vector<Socket*> sockets;  ///< a message on one of them ends the wait
  double for_s = 0;              ///< at most; 0: the next turn follows at once
};

class Turns {
 public:
  virtual ~Turns() = default;
  /// Does all work that is due now. Nothing: the process is over.
  virtual std::optional<Wait> turn() = 0;
};

inline void take_turns(Turns& turns) {
  while (const auto wait = turns.turn())
    if (wait->for_s > 0) wait_readable_s(wait->sockets, wait->for_s);
}

}  // namespace telesplat::net
