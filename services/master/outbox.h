// What the master sends: plans and MasterCore put messages in, the service takes them out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/wire/serial.h"

namespace telesplat::master {

/// A message to send: peer is the routing id on the control socket.
struct Outgoing {
  std::string peer, type, body;
};

class Outbox {
 public:
  /// Not one that no receiver would take.
  template <class M>
  void send(const std::string& peer, const M& m) {
    std::string body = wire::encode(m);
    if (fits<M>(body)) messages_.push_back({peer, std::string(M::kName), std::move(body)});
  }
  /// Whether receivers take the encoded M; if not, it is told, once for the whole outbox.
  template <class M>
  bool fits(const std::string& body) {
    if (body.size() <= wire::kBodyLimit<M>) return true;
    if (!std::exchange(told_, true))
      log::error("a {} of {} bytes is not sent: limit {}", M::kName, body.size(), wire::kBodyLimit<M>);
    return false;
  }
  void send(Outgoing message) { messages_.push_back(std::move(message)); }
  size_t size() const { return messages_.size(); }
  /// In the order in which they were sent.
  std::vector<Outgoing> take() { return std::exchange(messages_, {}); }

 private:
  bool told_ = false;  // that one was too large
  std::vector<Outgoing> messages_;
};

}  // namespace telesplat::master
