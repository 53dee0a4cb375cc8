// Messages that the master is to send: plans and MasterCore put them in, the service takes them out.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/wire/lease_seal.h"
#include "common/wire/serial.h"

namespace telesplat::master {

/// A message to send: peer is the routing id on the control socket.
struct Outgoing {
  std::string peer, type, body;
};

class Outbox {
 public:
  /// instance_of: returns the instance of the sampler with this routing id.
  Outbox(InstanceId master, std::function<InstanceId(const std::string& sampler)> instance_of)
      : master_(master), instance_of_(std::move(instance_of)) {}

  /// Sends a wire::Lease or wire::SliceLease with the master's mark and seal. sampler: routing id of its receiver.
  template <class L>
  void send_lease(const std::string& sampler, L& lease) {
    lease.master = master_;
    wire::seal(lease, instance_of_(sampler), lease_key_);
    send(sampler, lease);
  }
  /// Key of the seals, for the packer.
  const std::vector<uint32_t>& lease_key() const { return lease_key_; }
  /// Sends m, unless it is too large for receivers.
  template <class M>
  void send(const std::string& peer, const M& m) {
    std::string body = wire::encode(m);
    if (fits<M>(body)) messages_.push_back({peer, std::string(M::kName), std::move(body)});
  }
  /// True if receivers take an encoded M of this size. If not, the outbox logs it, once for all messages.
  template <class M>
  bool fits(const std::string& body) {
    if (body.size() <= wire::kBodyLimit<M>) return true;
    if (!std::exchange(told_, true))
      log::error("a {} of {} bytes is not sent: limit {}", M::kName, body.size(), wire::kBodyLimit<M>);
    return false;
  }
  void send(Outgoing message) { messages_.push_back(std::move(message)); }
  size_t size() const { return messages_.size(); }
  /// Takes the messages, in the order in which they were sent.
  std::vector<Outgoing> take() { return std::exchange(messages_, {}); }

 private:
  InstanceId master_;
  std::function<InstanceId(const std::string&)> instance_of_;
  std::vector<uint32_t> lease_key_ = wire::make_lease_key();
  bool told_ = false;  // logged that a message was too large
  std::vector<Outgoing> messages_;
};

}  // namespace telesplat::master
