// The loop of a process, cut where it waits: a simulation of whole sessions takes turns of many processes in one.
#pragma once

#include <optional>
#include <vector>

#include "common/net/socket.h"

namespace telesplat::net {

/// What a process waits for between two turns.
struct Wait {
  std::vector<Socket*> sockets;  ///< a message on one of them ends the wait
  double for_s = 0;              ///< at most; 0: it goes on at once
};

class Turns {
 public:
  virtual ~Turns() = default;
  /// Does what is due now. Nothing: the process is over.
  virtual std::optional<Wait> turn() = 0;
};

inline void take_turns(Turns& turns) {
  while (const auto wait = turns.turn())
    if (wait->for_s > 0) wait_readable_s(wait->sockets, wait->for_s);
}

}  // namespace telesplat::net
