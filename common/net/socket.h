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

/// Owns ZeroMQ's I/O threads; one a process. Sockets must not outlive it.
class Context {
 public:
  /// access: the proxies for connections over TCP, and the keys by which its sockets identify others and themselves;
  /// without keys nothing is encrypted.
  explicit Context(Access access = {});
  /// Makes sockets of a simulated network.
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
  std::string user;          ///< name of the sender's key, on a socket that binds with keys
  std::optional<Role> role;  ///< role of that key; nothing: no keys, so the sender is unknown
};

struct SocketOptions {
  int high_water_mark = 1000;  ///< messages queued each way before ROUTER, PUB drop and PUSH, DEALER refuse
  size_t max_message_bytes =
      wire::kMaxControlBytes;     ///< larger bodies are dropped; a peer that claims over 16 MiB more is disconnected
  int linger_ms = 500;            ///< time to send the rest of the queue when the socket is destroyed
  double patience_s = 10;         ///< a connection whose other end does not answer for longer counts as broken
  bool watch_connecting = false;  ///< count failed attempts to connect
  /// A thread of its own receives and sends messages at once, so that Message::arrived_s tells the network's time from
  /// the time that a message waited for its reader. For DEALER, PULL and SUB. The socket must be bound or connected
  /// before the first message is sent or received.
  bool read_ahead = false;
  std::string_view toward;  ///< role of the server; Via may have a proxy for it
  /// Purpose of a socket that binds, as the table of roles names it (keys/roles.h): "control", "tiles" and so on. With
  /// keys, a socket without a purpose cannot be bound.
  std::string_view serves;
  size_t most_connections = 1024;  ///< at a time, of a socket that binds; further ones are hung up on
  /// For a socket that binds: limit of unread bytes of one TCP connection, in whole messages and in parts; above it the
  /// connection is hung up on, and counts as refused. 0: 8 MiB more than the largest message that does not end its
  /// connection.
  uint64_t most_unread_bytes = 0;
  /// For a ROUTER or PUB: limit of bytes that wait for one peer; a peer without queued bytes may have one message of
  /// any size. Above it, a ROUTER drops messages, as above the high-water mark; a PUB hangs up on the subscriber.
  uint64_t most_queued_bytes = uint64_t(256) << 20;
};

/// SocketOptions::patience_s for messages of megabytes over links of a megabit a second.
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
  /// Connects; the peer may start later, and may come back after being away.
  Status connect(const std::string& endpoint);

  /// Queues a message without waiting (ROUTER: for `peer`). False: dropped, because too many bytes or messages wait or
  /// the peer is gone.
  template <class M>
  bool send(const M& message, std::string_view peer = {}) {
    return send_frames(peer, M::kName, wire::encode(message));
  }
  /// Sends an already encoded message, shared by several receivers.
  bool send_frames(std::string_view peer, std::string_view type, std::string body);

  /// Makes a message only if the peer's queue takes it; `bytes`: its approximate size. Not with read_ahead.
  template <class M>
  bool send_made(std::string_view peer, uint64_t bytes, const std::function<M()>& make) {
    return send_made(peer, M::kName, bytes, [&] { return wire::encode(make()); });
  }

  /// With read_ahead: returns a message, its type and body, that the reading thread sends by itself. Called at least
  /// every 100 ms, even if the owner is busy. To be set before the first message is sent or received.
  using Due = std::function<std::optional<std::pair<std::string, std::string>>()>;
  void set_due(Due due);

  /// Next message, without waiting (PUB: none, but viewers' subscriptions are read). Drops and counts messages that are
  /// not [peer,] type, body within the limits; with keys, also those that the sender's role may not send here.
  std::optional<Message> receive();

  /// Decodes a message of known type. Counts and logs a bad one, naming its peer, and returns nothing.
  template <class M>
  std::optional<M> decode(const Message& message) {
    auto result = wire::decode<M>(message.body);
    if (result) return std::move(*result);
    reject(message, result.error().text);
    return std::nullopt;
  }
  /// Counts and logs a message that cannot be used.
  void reject(const Message& message, const std::string& why);

  /// Number of messages dropped as malformed, oversized or unexpected, and of accepted connections that ended without
  /// one message: random bytes, other protocols, failed handshakes, frames that claim more than the limit.
  uint64_t rejected() const;
  /// With SocketOptions::watch_connecting: number of attempts to connect that failed, because no process listens or no
  /// machine has the address. ZeroMQ goes on trying.
  uint64_t failed_connections() const;
  /// On a socket that binds with keys: number of connections refused because they showed no key, another server's, or
  /// one that is not on the allow-list or has the wrong role.
  uint64_t keys_refused() const;
  /// On a socket that binds: number of connections hung up on, beyond SocketOptions::most_connections or
  /// most_unread_bytes, or because a subscriber asked for less than everything.
  uint64_t connections_refused() const;
  /// Bytes of bodies that a ROUTER has yet to send to this peer.
  uint64_t queued_bytes(std::string_view peer) const;
  /// Number of messages dropped and subscribers hung up on because of SocketOptions::most_queued_bytes.
  uint64_t queue_refused() const;
  /// With SocketOptions::watch_connecting: why the other side refuses this socket, as far as it says; empty: it does
  /// not, or nothing is known yet. Waiting does not help, unless `may_pass`.
  struct Refusal {
    std::string text;
    bool may_pass = false;
  };
  Refusal refusal() const;
  /// With SocketOptions::watch_connecting: true if the last attempt to connect reached a ZeroMQ peer.
  bool in_touch() const;
  /// True if it connects through a proxy.
  bool tunnelled() const;
  const std::string& name() const;

  Carrier& carrier() const { return *carrier_; }

 private:
  bool send_made(std::string_view peer, std::string_view type, uint64_t bytes,
                 const std::function<std::string()>& encoded);
  std::unique_ptr<Carrier> carrier_;
};

/// Waits until one of the sockets has a message, `timeout_ms` passed, or a signal came. True if a message is there.
/// Does not wait for sockets of a simulated network: a simulation ends turns instead.
bool wait_readable(const std::vector<Socket*>& sockets, int timeout_ms);
/// The same for at most `timeout_s`, to some 50 us; sleeps through the last part of a millisecond.
bool wait_readable_s(const std::vector<Socket*>& sockets, double timeout_s);

/// A random, non-zero instance id.
InstanceId make_instance_id();

}  // namespace telesplat::net
