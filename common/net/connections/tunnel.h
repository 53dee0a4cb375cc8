// A way through a SOCKS5 proxy (RFC 1928) for one socket that connects. ZeroMQ's own support ends the process (4.3.4:
// "Bad file descriptor") when a socket is closed whose last attempt the proxy did not take or refused: a packer or
// relay that is gone would end its viewers. Private to this library.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "common/core/result.h"

namespace telesplat::net {

class Tunnel {
 public:
  /// proxy, target: HOST:PORT; an IPv6 address in brackets. A proxy that acknowledges nothing for patience_s is gone.
  /// Does not connect yet. Error: the system's refusal, or names the text that is no HOST:PORT.
  static Result<std::unique_ptr<Tunnel>> open(const std::string& proxy, const std::string& target, double patience_s);
  /// Ends connections at once.
  ~Tunnel();

  /// Local address for the socket to connect to instead; lets in only processes of this user, one at a time. Each
  /// connection to it becomes one to the target; it ends if the target cannot be reached.
  const std::string& endpoint() const { return endpoint_; }
  /// Number of connections to the target that failed. Any thread.
  uint64_t failed() const { return failed_; }
  /// Its socket is being closed: passes the messages still to be sent, then becomes over().
  void retire();
  bool over() const { return over_; }

 private:
  class Worker;
  Tunnel() = default;

  std::string endpoint_;
  std::atomic<uint64_t> failed_ = 0;
  std::atomic<bool> retired_ = false, stop_ = false, over_ = false;
  int woken_ = -1;  // an eventfd: retired_ or stop_ have changed
  std::thread thread_;
};

}  // namespace telesplat::net
