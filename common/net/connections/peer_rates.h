// How many messages a second each peer may send: who floods a socket is no other's business. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/core/token_bucket.h"

namespace telesplat::net {

class PeerRates {
 public:
  /// rate: messages of a peer a second; two seconds' worth of them at once after a quiet time, since a process that was
  /// stopped finds as many waiting.
  explicit PeerRates(double rate) : rate_(rate) {}

  /// One more message of this peer (Message::peer) may be looked at; else it is counted.
  bool admit(const std::string& peer, double now_s);
  uint64_t refused() const { return refused_; }

 private:
  void forget_idle(double now_s);

  const double rate_;
  uint64_t refused_ = 0;
  std::unordered_map<std::string, TokenBucket> peers_;
  double forgot_s_ = -1e300;
};

}  // namespace telesplat::net
