// How many messages a second each peer may send: who floods a socket is no other's business. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/core/token_bucket.h"
#include "common/net/socket.h"

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

// How much of a process' time each guest's messages may take: a limit of messages alone lets large ones through. No
// sockets, no clocks.

/// Who a message counts to: the owner of a viewer's key; where there are no keys its connection. nullptr: a key of
/// another role, whose owner may end the session anyway.
inline const std::string* payer(const Message& message) {
  if (!message.role) return &message.peer;
  return *message.role == Role::kViewer ? &message.user : nullptr;
}

class WorkShares {
 public:
  static constexpr double kShare = 0.2;    ///< of the time
  static constexpr double kBurst_s = 0.5;  ///< at once after a quiet time

  /// One more message of theirs may be handled; else it is counted.
  bool admit(const std::string& payer, double now_s);
  /// What handling one took. It may take more than is left: then they wait for longer.
  void worked(const std::string& payer, double seconds, double now_s);
  uint64_t refused() const { return refused_; }

 private:
  // Those who have all of their time left are not kept.
  struct Owed {
    double seconds = 0, at_s = 0;
  };
  double owed_s(const Owed& owed, double now_s) const;

  std::unordered_map<std::string, Owed> owed_;
  uint64_t refused_ = 0;
  double forgot_s_ = -1e300;
};

}  // namespace telesplat::net
