// ZeroMQ sockets for messages of other programs: one frame, without the type that our own messages have. Every queue is
// bounded, every size limited.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/result.h"

namespace telesplat::net {

struct PlainLimits {
  int queued = 1000;             ///< messages; beyond that the newest are dropped
  int64_t most_bytes = 1 << 16;  ///< a peer that sends a larger frame is disconnected
};

/// Receives all messages of a publisher. The publisher need not exist yet, and may come back after being away.
class PlainSubscriber {
 public:
  /// Error: the endpoint is not valid.
  static Result<std::unique_ptr<PlainSubscriber>> connect(const std::string& endpoint, const PlainLimits& limits = {});
  ~PlainSubscriber();

  /// Waits until a message is there, `timeout_ms` passed, or a signal came. True: a message is there.
  bool wait(int timeout_ms);
  /// Connects anew to a publisher that broke the rules (a message over most_bytes): ZeroMQ does not do so by itself. A
  /// publisher that is merely silent loses only messages that it sends meanwhile.
  void connect_again();
  /// Returns the next message without waiting: the last of its frames, so that publishers may put a topic in front.
  std::optional<std::string> receive();

 private:
  struct Impl;
  explicit PlainSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Publishes to all subscribers.
class PlainPublisher {
 public:
  /// Binds to tcp://ADDRESS:PORT (PORT may be *) or ipc://. An address other than loopback is refused unless
  /// `insecure`. Error: names the endpoint.
  static Result<std::unique_ptr<PlainPublisher>> bind(const std::string& endpoint, bool insecure,
                                                      const PlainLimits& limits = {});
  ~PlainPublisher();

  /// The endpoint with its real port.
  const std::string& endpoint() const;
  /// True if a subscriber is known, without waiting.
  bool heard();
  /// Never waits: a subscriber that is too slow misses messages.
  void send(const std::string& body);

 private:
  struct Impl;
  explicit PlainPublisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::net
