// ZeroMQ sockets that carry wire messages. Every queue is bounded, every message size limited; bad input is dropped,
// counted and logged (at most once a second a socket), never thrown.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/core/result.h"
#include "common/net/keys/access.h"
#include "common/wire/serial.h"

namespace telesplat::net {

enum class Kind { kRouter, kDealer, kPush, kPull, kPub, kSub };

class Carrier;
class Network;

/// One a process: ZeroMQ's I/O threads. Sockets must not outlive it.
class Context {
 public:
  /// access: the proxies that connections over TCP go through, and the keys by which its sockets know others and are
  /// known; without keys nothing is encrypted.
  explicit Context(Access access = {});
  /// Makes sockets of a network that is simulated.
  explicit Context(std::unique_ptr<Network> network);
  ~Context();
  Network& network() { return *network_; }

 private:
  std::unique_ptr<Network> network_;
};

/// A received message. body points into memory that `owner` keeps alive.
struct Message {
  std::string peer;  ///< routing id of the sender (ROUTER only)
  std::string type;
  wire::Bytes body;
  std::shared_ptr<const void> owner;
  double arrived_s = 0;      ///< monotonic_s() when it was read off the connection
  std::string user;          ///< of a socket that binds with keys: the name of the sender's key
  std::optional<Role> role;  ///< and its role; nothing: there are no keys, and anybody may be the sender
};

struct SocketOptions {
  int high_water_mark = 1000;  ///< messages queued each way before ROUTER, PUB drop and PUSH, DEALER refuse
  size_t max_message_bytes =
      wire::kMaxControlBytes;     ///< larger bodies are dropped; a peer that claims over 16 MiB more is disconnected
  int linger_ms = 500;            ///< for what is still to be sent when the socket goes
  double patience_s = 10;         ///< a connection whose other end does not answer for longer is taken for broken
  bool watch_connecting = false;  ///< count attempts to connect that fail
  /// A thread of its own reads messages as they come and sends what is given to it, so that Message::arrived_s tells
  /// the network from the time that a message waited for its reader. For DEALER, PULL and SUB. Addresses must be bound
  /// or connected before the first message is sent or received.
  bool read_ahead = false;
  std::string_view toward;  ///< role of who is connected to, where Via has a proxy of its own for it
  /// What a socket that binds is for, as the table of roles calls it (keys/roles.h): "control", "tiles" and so on. With
  /// keys, one that is for nothing cannot be bound.
  std::string_view serves;
  size_t most_connections = 1024;  ///< of a socket that binds, at a time; further ones are hung up on
  /// Of a socket that binds, bytes of one connection over TCP that came and were not read yet, of whole messages and of
  /// parts; beyond, it is hung up on, and counts as one too many. 0: 8 MiB more than a message may have before its
  /// connection ends.
  uint64_t most_unread_bytes = 0;
  /// Of a ROUTER or PUB, bytes that wait for one peer, who may have one message of any size all the same. What is
  /// beyond is dropped for a peer of a ROUTER, as beyond the high-water mark; a subscriber is hung up on.
  uint64_t most_queued_bytes = uint64_t(256) << 20;
};

/// SocketOptions::patience_s where messages of megabytes go over links of a megabit a second.
inline constexpr double kBulkPatience_s = 60;

class Socket {
 public:
  Socket(Context& context, Kind kind, std::string name, const SocketOptions& options = {});
  ~Socket();
  Socket(Socket&&) noexcept;
  Socket& operator=(Socket&&) noexcept;

  /// Binds to tcp://ADDRESS:PORT (PORT may be *), ipc:// or inproc://. Returns the endpoint with its real port. An
  /// address other than loopback is refused unless the context has keys, or `insecure`.
  Result<std::string> bind(const std::string& endpoint, bool insecure = false);
  /// Connects; the peer need not exist yet and may come back after being away.
  Status connect(const std::string& endpoint);

  /// Queues a message without waiting (ROUTER: for `peer`). False: dropped, because too much waits already or the peer
  /// is gone.
  template <class M>
  bool send(const M& message, std::string_view peer = {}) {
    return send_frames(peer, M::kName, wire::encode(message));
  }
  /// Sends an already encoded message, shared by several receivers.
  bool send_frames(std::string_view peer, std::string_view type, std::string body);

  /// Makes a message only if the peer's queue takes it; `bytes`: about as many as it will have. Not with read_ahead.
  template <class M>
  bool send_made(std::string_view peer, uint64_t bytes, const std::function<M()>& make) {
    return send_made(peer, M::kName, bytes, [&] { return wire::encode(make()); });
  }

  /// With read_ahead: what the thread that reads is to say by itself, a message's type and body. It is asked at least
  /// every 100 ms, however busy the owner is. To be set before anything is sent or received.
  using Due = std::function<std::optional<std::pair<std::string, std::string>>()>;
  void set_due(Due due);

  /// Next message, without waiting (PUB: never one, but viewers' subscriptions are looked at). Messages that are not
  /// [peer,] type, body within the limits are dropped and counted; with keys, also those that the sender's role may not
  /// send here.
  std::optional<Message> receive();

  /// Decodes a message of known type; a bad one is counted and logged, naming its peer, and nothing comes back.
  template <class M>
  std::optional<M> decode(const Message& message) {
    auto result = wire::decode<M>(message.body);
    if (result) return std::move(*result);
    reject(message, result.error().text);
    return std::nullopt;
  }
  /// Counts and logs a message that cannot be used.
  void reject(const Message& message, const std::string& why);

  /// Messages dropped for being malformed, oversized or unexpected, and connections accepted that ended without having
  /// brought one message: random bytes, other protocols, failed handshakes, frames that claim more than is ever read.
  uint64_t rejected() const;
  /// With SocketOptions::watch_connecting: attempts to connect so far that came to nothing, because nobody listens
  /// there or the address is of no machine. ZeroMQ goes on trying.
  uint64_t failed_connections() const;
  /// Of a socket that binds with keys: connections that were not let in, because they showed no key, another server's,
  /// or one that is not on the allow-list or is for something else.
  uint64_t keys_refused() const;
  /// Of a socket that binds: connections that were hung up on because there were SocketOptions::most_connections, or
  /// more bytes of one than SocketOptions::most_unread_bytes, or because a subscriber wanted anything but all.
  uint64_t connections_refused() const;
  /// Bytes of bodies that a ROUTER has yet to send to this peer.
  uint64_t queued_bytes(std::string_view peer) const;
  /// Messages dropped and subscribers hung up on because of SocketOptions::most_queued_bytes.
  uint64_t queue_refused() const;
  /// With SocketOptions::watch_connecting: why it was not let in where it connects to, as far as it was told; empty: it
  /// was, or nothing is known yet. What is told does not change by waiting, unless `may_pass`.
  struct Refusal {
    std::string text;
    bool may_pass = false;
  };
  Refusal refusal() const;
  /// With SocketOptions::watch_connecting: the last attempt to connect reached somebody who speaks ZeroMQ.
  bool in_touch() const;
  /// It connects through a proxy.
  bool tunnelled() const;
  const std::string& name() const;

  Carrier& carrier() const { return *carrier_; }

 private:
  bool send_made(std::string_view peer, std::string_view type, uint64_t bytes,
                 const std::function<std::string()>& encoded);
  std::unique_ptr<Carrier> carrier_;
};

/// Waits until one of the sockets has a message, `timeout_ms` passed, or a signal came. True if a message is there.
/// Sockets of a simulated network are not waited for: in a simulation turns end in place of waits.
bool wait_readable(const std::vector<Socket*>& sockets, int timeout_ms);
/// The same for at most `timeout_s`, to some 50 us; the last part of a millisecond is slept, whatever comes.
bool wait_readable_s(const std::vector<Socket*>& sockets, double timeout_s);

/// A random, non-zero instance id.
InstanceId make_instance_id();

}  // namespace telesplat::net
