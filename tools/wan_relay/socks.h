// The dialogue with a client of a SOCKS5 proxy (RFC 1928) before its bytes are passed on: without sockets.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::wan_relay {

/// Takes the first bytes of a client, in any pieces.
class SocksDialogue {
 public:
  enum class State { kGreeting, kRequest, kAsked };

  /// Error: the client speaks another protocol, wants a password, wants anything but a connection, or does not wait for
  /// answers.
  Status take(std::string_view bytes);

  State state() const { return state_; }
  /// Returns the answer that is due to the client, once.
  std::string take_answer();
  /// kAsked: the target that it wants to be connected to.
  const std::string& host() const { return host_; }
  uint16_t port() const { return port_; }

  /// The answers to a request.
  enum class Outcome : uint8_t { kConnected = 0, kFailed = 1, kUnreachable = 4, kRefused = 5 };
  static std::string reply(Outcome outcome);

 private:
  Status take_greeting();
  Status take_request();

  State state_ = State::kGreeting;
  std::string buffer_, answer_, host_;
  uint16_t port_ = 0;
};

}  // namespace telesplat::wan_relay
