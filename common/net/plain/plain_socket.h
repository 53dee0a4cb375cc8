// ZeroMQ sockets for what other programs publish: messages of one frame, without the type that our own bear. Every
// queue is bounded, every size limited.
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

/// Hears everything that a publisher says. The publisher need not exist yet, and may come back after being away.
class PlainSubscriber {
 public:
  /// Error: the endpoint is none.
  static Result<std::unique_ptr<PlainSubscriber>> connect(const std::string& endpoint, const PlainLimits& limits = {});
  ~PlainSubscriber();

  /// Until a message is there, `timeout_ms` passed, or a signal came. True: a message is there.
  bool wait(int timeout_ms);
  /// A publisher that broke the rules (a message over most_bytes) is never spoken to again unless it is asked anew. One
  /// that is merely silent loses nothing but what it says in the meantime.
  void connect_again();
  /// Without waiting. Of several frames the last one, so that publishers may put a topic in front.
  std::optional<std::string> receive();

 private:
  struct Impl;
  explicit PlainSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Tells everybody who listens.
class PlainPublisher {
 public:
  /// Binds to tcp://ADDRESS:PORT (PORT may be *) or ipc://. An address other than loopback is refused unless
  /// `insecure`. Error: names the endpoint.
  static Result<std::unique_ptr<PlainPublisher>> bind(const std::string& endpoint, bool insecure,
                                                      const PlainLimits& limits = {});
  ~PlainPublisher();

  /// With its real port.
  const std::string& endpoint() const;
  /// Somebody listens, as far as is known without waiting.
  bool heard();
  /// Never waits: who does not keep up misses messages.
  void send(const std::string& body);

 private:
  struct Impl;
  explicit PlainPublisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::net
