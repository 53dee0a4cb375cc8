// Peers without a part in the session: those who give orders, strangers who say what others say, impostors. Private to
// this library.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/wire/messages.h"
#include "tools/lab/simulation/session.h"

namespace telesplat::simulation {

/// Messages that were sent so far, which strangers send again.
struct Heard {
  std::map<std::string, std::string> to_master;  ///< bodies, the newest of each type
  std::map<std::string, std::string> to_packer;  ///< to its socket "state"
  std::map<std::string, std::string> hellos;     ///< the newest of each role
  std::string packer_state;                      ///< its address
  void listen(const Passed& message);
};

class Session::Peer {
 public:
  Peer(SimulatedNetwork& network, int process, bool keys, const Event& event);

  /// Sends the event's message. name: a process with the role of event.b.
  void speak(const Event& event, const std::string& name, const Heard& heard, Dice& dice);

 private:
  net::Context context_;
  net::Socket socket_;
};

}  // namespace telesplat::simulation
