// How much of a process' time each guest's messages may take: a limit of messages alone lets large ones through. No
// sockets, no clocks.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "common/net/socket.h"

namespace telesplat::net {

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
