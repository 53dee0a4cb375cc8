// Carriers transport a socket's messages: ZeroMQ (zeromq.cpp), or a simulated network (tools/lab/simulation). Socket
// documents each function.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/net/socket.h"

namespace telesplat::net {

class Carrier {
 public:
  virtual ~Carrier() = default;

  virtual Result<std::string> bind(const std::string& endpoint, bool insecure) = 0;
  virtual Status connect(const std::string& endpoint) = 0;
  /// make(): returns the body, of about `bytes`; called only if the peer's queue takes it.
  virtual bool send(std::string_view peer, std::string_view type, uint64_t bytes,
                    const std::function<std::string()>& make) = 0;
  virtual void set_due(Socket::Due due) = 0;
  virtual std::optional<Message> receive() = 0;
  /// True if receive() has a message. Nothing: unknown here, so wait_readable() polls ZeroMQ.
  virtual std::optional<bool> readable() = 0;
  virtual void reject(const Message& message, const std::string& why) = 0;

  virtual uint64_t rejected() = 0;
  virtual uint64_t failed_connections() = 0;
  virtual uint64_t keys_refused() = 0;
  virtual uint64_t connections_refused() = 0;
  virtual uint64_t queued_bytes(std::string_view peer) = 0;
  virtual uint64_t queue_refused() = 0;
  virtual Socket::Refusal refusal() = 0;
  virtual bool in_touch() = 0;
  virtual bool tunnelled() = 0;
  virtual const std::string& name() const = 0;
  virtual bool reads_ahead() const = 0;  ///< SocketOptions::read_ahead
};

/// Opens carriers.
class Network {
 public:
  virtual ~Network() = default;
  virtual std::unique_ptr<Carrier> open(Kind kind, std::string name, const SocketOptions& options) = 0;
};

/// The network that opens ZeroMQ's sockets.
std::unique_ptr<Network> make_zeromq(Access access);

}  // namespace telesplat::net
