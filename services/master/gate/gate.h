// Decides who may take part in a session, and limits the share of the master that each peer gets: one that floods it,
// or says hello with a name that would deceive a terminal, does not disturb the others.
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
  uint64_t max_sampling_pixels = 1u << 24;  ///< pixels of a view; larger views are sampled coarser
  uint64_t max_peers = 512;                 ///< processes at a time
  double max_messages = 5000;  ///< messages of a peer per second; the packer, which reports every tile, is exempt
};

/// Counts how often each limit was hit.
struct LimitsHit {
  uint64_t views_coarser = 0, hellos_refused = 0, messages_refused = 0;
};

class Gate {
 public:
  explicit Gate(const Limits& limits) : limits_(limits), rates_(limits.max_messages) {}

  /// True if one more message of this peer may be handled; else it counts as refused.
  bool admit(const std::string& peer, double now_s) { return rates_.admit(peer, now_s); }
  bool admit_work(const std::string& payer, double now_s) { return work_.admit(payer, now_s); }
  void worked(const std::string& payer, double seconds, double now_s) { work_.worked(payer, seconds, now_s); }
  /// Returns the view as it is sampled: if it has more pixels than the limit, every k-th pixel of every k-th row.
  wire::ViewRequest admit(const wire::ViewRequest& view);
  /// Counts a hello that is refused.
  void refuse_hello() { ++hit_.hellos_refused; }
  /// True if the log may have one more line about a process that comes or goes: at most what a person can read.
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

/// Checks senders further than the table of roles, which knows only a message's name: the role that a sender claims,
/// the process in whose name it speaks, and the commands that it gives.
class Senders {
 public:
  /// Processes that are remembered. One more pushes out the oldest of the key that has most, so that no key's owner can
  /// make this forget another's.
  static constexpr size_t kMost = 8192;

  /// Error: the sender's fault; the message must not reach the core. An unknown sender passes, unless it speaks for a
  /// process of another key: the core asks it who it is.
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
  // Messages of viewers and samplers that name their sender; in other messages these fields name another process.
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
    std::list<InstanceId>::iterator place;  ///< place in of_user_
  };
  void forget(InstanceId instance);

  std::unordered_map<InstanceId, Owner> owners_;
  std::unordered_map<std::string, InstanceId> instances_;  // by routing id
  std::map<std::string, std::list<InstanceId>> of_user_;   // instances in owners_ by user, oldest hello first
};

}  // namespace telesplat::master
