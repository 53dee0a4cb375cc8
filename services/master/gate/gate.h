// Who may take part in a session, and how much of the master each may have: one peer that floods it, or says hello with
// a name that would deceive a terminal, is no other's business.
#pragma once

#include <cstdint>
#include <string>

#include "common/core/result.h"
#include "common/core/token_bucket.h"
#include "common/net/connections/peer_rates.h"
#include "common/net/connections/work_shares.h"
#include "common/wire/session_messages.h"
#include "common/wire/tile_messages.h"

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

}  // namespace telesplat::master
