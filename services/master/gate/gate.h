// Who may take part in a session, and how much of the master each may have: one peer that floods it, or says hello with
// a name that would deceive a terminal, is no other's business.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <string>
#include <unordered_map>

#include "common/core/result.h"
#include "common/core/token_bucket.h"
#include "common/net/connections/peer_rates.h"
#include "common/net/socket.h"
#include "common/wire/messages.h"

namespace telesplat::master {

struct Limits {
  uint64_t max_sampling_pixels = 1u << 24;  ///< of a view; larger ones are sampled coarser
  uint64_t max_peers = 512;                 ///< processes at a time
  double max_messages = 5000;               ///< of a peer, a second; the packer, which tells of every tile, is exempt
};

/// How often each limit bit.
struct LimitsHit {
  uint64_t views_coarser = 0, hellos_refused = 0, messages_refused = 0;
};

class Gate {
 public:
  explicit Gate(const Limits& limits) : limits_(limits), rates_(limits.max_messages) {}

  /// One more message of this peer may be looked at.
  bool admit(const std::string& peer, double now_s) { return rates_.admit(peer, now_s); }
  bool admit_work(const std::string& payer, double now_s) { return work_.admit(payer, now_s); }
  void worked(const std::string& payer, double seconds, double now_s) { work_.worked(payer, seconds, now_s); }
  /// The view as it is sampled: where it has more pixels than the limit, every k-th of every k-th row.
  wire::ViewRequest admit(const wire::ViewRequest& view);
  /// Counts a hello that is refused.
  void refuse_hello() { ++hit_.hellos_refused; }
  /// A line of the log about who comes and goes: not more often than a person reads.
  bool may_log(double now_s) { return log_.take(now_s); }
  const Limits& limits() const { return limits_; }
  LimitsHit hit() const {
    LimitsHit out = hit_;
    out.messages_refused = rates_.refused() + work_.refused();
    return out;
  }

 private:
  const Limits limits_;
  LimitsHit hit_;
  net::PeerRates rates_;
  net::WorkShares work_;
  TokenBucket log_{10, 200};
};

/// What a sender may say, beyond what the table of roles tells by a message's name alone: who it says it is, in whose
/// name it speaks, and which commands it gives.
class Senders {
 public:
  /// Processes that are remembered. Of more, the first one of the key that has the most is forgotten, so that no key's
  /// owner can make this forget another's.
  static constexpr size_t kMost = 8192;

  /// Errors are the sender's fault; the message must not reach the core then. A sender who is not known, and does not
  /// speak for a process of another key, is let pass: the core asks who it is.
  Status admit(const net::Message& from, const wire::Hello& m);
  Status admit(const net::Message& from, const wire::Goodbye& m);
  Status admit(const net::Message& from, const wire::SwapReady& m);
  Status admit(const net::Message& from, const wire::Control& m);
  template <class M>
  Status admit(const net::Message& from, const M& m) {
    if constexpr (requires { m.instance; })
      return speaks_for(from, m.instance);
    else if constexpr (requires { m.data; })
      return speaks_for(from, m.data);
    else if constexpr (is_request<M>)
      return speaks_for(from, claimed(m));
    else
      return ok_status();
  }

 private:
  // Messages of a viewer or sampler that name their sender; in others these fields mean somebody else.
  template <class M>
  static constexpr bool is_request = std::is_same_v<M, wire::ViewRequest> || std::is_same_v<M, wire::LeaseRequest> ||
                                     std::is_same_v<M, wire::LeaseExtend> || std::is_same_v<M, wire::SlabReady>;
  static InstanceId claimed(const wire::ViewRequest& m) { return m.viewer; }
  static InstanceId claimed(const auto& m) { return m.sampler; }

  Status speaks_for(const net::Message& from, InstanceId instance) const;
  Status is_same_user(const net::Message& from, InstanceId instance) const;

  struct Owner {
    std::string peer;                       ///< routing id of the connection that said hello
    std::string user;                       ///< the name of its key; empty: there are no keys
    std::list<InstanceId>::iterator place;  ///< in of_user_
  };
  void forget(InstanceId instance);

  std::unordered_map<InstanceId, Owner> owners_;
  std::unordered_map<std::string, InstanceId> instances_;  // by routing id
  std::map<std::string, std::list<InstanceId>> of_user_;   // owners_, the first hello first
};

}  // namespace telesplat::master
