// What the master sends: plans and MasterCore put messages in, the service takes them out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/wire/serial.h"

namespace telesplat::master {

/// A message to send: peer is the routing id on the control socket.
struct Outgoing {
  std::string peer, type, body;
};

class Outbox {
 public:
  template <class M>
  void send(const std::string& peer, const M& m) {
    messages_.push_back({peer, std::string(M::kName), wire::encode(m)});
  }
  void send(Outgoing message) { messages_.push_back(std::move(message)); }
  size_t size() const { return messages_.size(); }
  /// In the order in which they were sent.
  std::vector<Outgoing> take() { return std::exchange(messages_, {}); }

 private:
  std::vector<Outgoing> messages_;
};

}  // namespace telesplat::master
