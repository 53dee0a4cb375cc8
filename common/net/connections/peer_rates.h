// Limits the messages a second of each peer, so that a flood of one does not harm the others. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/core/token_bucket.h"
#include "common/net/socket.h"

namespace telesplat::net {

class PeerRates {
 public:
  /// rate: messages of a peer a second. After a quiet time a peer may send two seconds' worth at once: a process that
  /// was stopped finds that many waiting.
  explicit PeerRates(double rate) : rate_(rate) {}

  /// True if one more message of this peer (Message::peer) may be handled; false: counts it as refused.
  bool admit(const std::string& peer, double now_s);
  uint64_t refused() const { return refused_; }

 private:
  void forget_idle(double now_s);

  const double rate_;
  uint64_t refused_ = 0;
  std::unordered_map<std::string, TokenBucket> peers_;
  double forgot_s_ = -1e300;
};

// Limits the share of a process' time that each guest's messages take: a limit of the number alone lets large ones
// through. No sockets, no clocks.

/// The payer of a message: the owner of a viewer's key; without keys its connection. nullptr: a key of another role,
/// whose owner may end the session anyway.
inline const std::string* payer(const Message& message) {
  if (!message.role) return &message.peer;
  return *message.role == Role::kViewer ? &message.user : nullptr;
}

class WorkShares {
 public:
  static constexpr double kShare = 0.2;    ///< share of the time
  static constexpr double kBurst_s = 0.5;  ///< seconds of work at once after a quiet time

  /// True if one more message of this payer may be handled; false: counts it as refused.
  bool admit(const std::string& payer, double now_s);
  /// Adds the time that one message took. It may exceed the rest of the share: then the payer waits for longer.
  void worked(const std::string& payer, double seconds, double now_s);
  uint64_t refused() const { return refused_; }

 private:
  // Time that a payer used beyond its share. Payers without such a debt are not stored.
  struct Owed {
    double seconds = 0, at_s = 0;
  };
  double owed_s(const Owed& owed, double now_s) const;

  std::unordered_map<std::string, Owed> owed_;
  uint64_t refused_ = 0;
  double forgot_s_ = -1e300;
};

}  // namespace telesplat::net
