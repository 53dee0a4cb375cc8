#include "common/net/carrier.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <unordered_map>
#include <utility>
#include <zmq.hpp>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/core/utf8.h"
#include "common/net/connections/connections.h"
#include "common/net/connections/greeting.h"
#include "common/net/connections/monitor.h"
#include "common/net/connections/queued_bytes.h"
#include "common/net/connections/tunnel.h"
#include "common/net/keys/doorkeeper.h"
#include "common/net/local_endpoint.h"
#include "common/net/read_ahead.h"
#include "common/parallel/handed_over.h"

namespace telesplat::net {
namespace {

// A frame at most this much over a socket's limit is still read, so that it can be dropped and counted with its peer's
// name; one that claims more ends its connection before memory is allocated for it.
constexpr int64_t kOversizedBytes = 16 << 20;
constexpr uint64_t kUnderWayBytes = 8 << 20;  // bytes of a connection that the kernel may still hold
constexpr int64_t kSubscriptionBytes = 4096;  // largest frame a publisher reads; handshakes fit
constexpr size_t kMaxTypeBytes = 64;
constexpr double kQuietPusher_s = 1.0;
// Consecutive handshakes that broke off without a reason: a server that ends breaks off one or two.
constexpr uint32_t kBrokenOff = 3;

zmq::socket_type zmq_type(Kind kind) {
  switch (kind) {
    case Kind::kRouter:
      return zmq::socket_type::router;
    case Kind::kDealer:
      return zmq::socket_type::dealer;
    case Kind::kPush:
      return zmq::socket_type::push;
    case Kind::kPull:
      return zmq::socket_type::pull;
    case Kind::kPub:
      return zmq::socket_type::xpub;  // delivers subscriptions, so that unusual ones can be counted
    case Kind::kSub:
      return zmq::socket_type::sub;
  }
  return zmq::socket_type::dealer;
}

// Escapes bytes for log lines: routing ids are binary.
std::string printable(std::string_view bytes) {
  std::string out;
  for (unsigned char c : bytes.substr(0, 24))
    out += c >= 32 && c < 127 ? std::string(1, char(c)) : fmt::format("\\x{:02x}", c);
  return out;
}

// True if one of the items is readable.
bool poll(std::vector<zmq::pollitem_t> items, int timeout_ms) {
  try {
    return zmq::poll(items, std::chrono::milliseconds(timeout_ms)) > 0;
  } catch (const zmq::error_t&) {  // EINTR: a signal; the caller looks at its stop flag
    return false;
  }
}

struct ZeroMq final : Network {
  explicit ZeroMq(Access access) : access(std::move(access)) {}
  std::unique_ptr<Carrier> open(Kind kind, std::string name, const SocketOptions& options) override;

  std::list<std::unique_ptr<Tunnel>> tunnels;  // they outlast the context, which still sends when sockets are closed
  zmq::context_t context{1};
  Access access;
  std::mutex mutex;                        // guards the members below: several threads may bind sockets
  std::unique_ptr<Doorkeeper> doorkeeper;  // made for the first socket that binds with keys
  std::unique_ptr<Lookout> lookout;        // made for the first socket that binds
  bool warned_of_clear = false;            // only the first socket warns

  Status let_in() {
    const std::lock_guard lock(mutex);
    if (doorkeeper) return ok_status();
    auto opened = Doorkeeper::open(context, *access.keys());
    if (!opened) return opened.error();
    doorkeeper = *std::move(opened);
    return ok_status();
  }

  Result<Tunnel*> open_tunnel(const std::string& proxy, const std::string& target, double patience_s) {
    auto opened = Tunnel::open(proxy, target, patience_s);
    if (!opened) return opened.error();
    const std::lock_guard lock(mutex);
    std::erase_if(tunnels, [](const auto& t) { return t->over(); });
    return tunnels.emplace_back(*std::move(opened)).get();
  }
  void retire(Tunnel& tunnel) {
    const std::lock_guard lock(mutex);
    tunnel.retire();
  }

  Lookout& watch() {
    const std::lock_guard lock(mutex);
    if (!lookout) lookout = std::make_unique<Lookout>();
    return *lookout;
  }
};

// Counts a socket's attempts to connect by their results.
struct Attempts {
  void watch(zmq::context_t& context, zmq::socket_t& socket) {
    if (!monitor)
      monitor.emplace(context, socket, ZMQ_EVENT_CONNECT_RETRIED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | kHandshakeFailed);
  }
  // tunnel: that the socket connects through; null: none.
  void look(const Tunnel* tunnel) {
    while (const auto event = monitor ? monitor->next() : std::nullopt) note(event->what, tunnel);
  }
  // A server with keys may close a connection before it sends its own greeting, so that libzmq cannot say why.
  void look_for_mechanism(const std::string& endpoint) {
    if (!std::exchange(looked_for_mechanism, true) && mechanism_at(endpoint) == "CURVE")
      turned_away = ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL;
  }
  // Events that show why the server does not let this socket in.
  static constexpr int kHandshakeFailed =
      ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

  void note(uint16_t what, const Tunnel* tunnel) {
    in_touch = what == ZMQ_EVENT_HANDSHAKE_SUCCEEDED;
    if (what == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
      broken_off = 0;
    } else if (what & kHandshakeFailed) {
      ++failed_unseen;
      if (tunnel && tunnel->failed() != tunnel_failed)  // no process listens at the tunnel's other end
        ++tunnel_failed, ++failed;
      else if (what == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL)
        ++broken_off;
      else
        turned_away = what;
    } else if (failed_unseen > 0) {  // a server is there, which did not let us in
      --failed_unseen;
    } else {
      ++failed;
    }
  }

  std::optional<Monitor> monitor;
  std::atomic<uint64_t> failed{0};
  std::atomic<bool> in_touch{false};
  std::atomic<uint32_t> broken_off{0}, turned_away{0};  // handshakes; event, 0: none
  uint64_t tunnel_failed = 0;                           // value of Tunnel::failed() when last read
  size_t failed_unseen = 0;                             // failed handshakes whose attempt's end was not reported yet
  bool looked_for_mechanism = false;
};

struct Parts {
  Parts(ZeroMq& home, Kind kind, std::string name, const SocketOptions& options)
      : home(home), kind(kind), name(std::move(name)), options(options), socket(home.context, zmq_type(kind)) {
    socket.set(zmq::sockopt::sndhwm, options.high_water_mark);
    socket.set(zmq::sockopt::rcvhwm, options.high_water_mark);
    socket.set(zmq::sockopt::maxmsgsize, most_frame_bytes());
    socket.set(zmq::sockopt::linger, options.linger_ms);
    socket.set(zmq::sockopt::reconnect_ivl, 50);
    socket.set(zmq::sockopt::reconnect_ivl_max, 500);
    look_after(socket, options.patience_s);
    if (kind == Kind::kSub) socket.set(zmq::sockopt::subscribe, "");
    if (kind == Kind::kRouter) socket.set(zmq::sockopt::router_mandatory, 1);
    if (kind == Kind::kPub) socket.set(zmq::sockopt::xpub_verboser, 1);
  }

  ~Parts() {
    ahead.reset();
    if (connections) home.watch().remove(*connections);
    if (tunnel) home.retire(*tunnel);
  }

  // Largest frame that is read; a frame that claims more ends its connection.
  int64_t most_frame_bytes() const {
    return kind == Kind::kPub ? kSubscriptionBytes : static_cast<int64_t>(options.max_message_bytes) + kOversizedBytes;
  }
  uint64_t most_unread_bytes() const {
    return options.most_unread_bytes ? options.most_unread_bytes : kUnderWayBytes + uint64_t(most_frame_bytes());
  }

  // Address that this socket connects to for `endpoint`: itself, or a tunnel.
  Result<std::string> way_to(const std::string& endpoint) {
    constexpr std::string_view kTcp = "tcp://";
    const std::string proxy = home.access.via().proxy(std::string(options.toward));
    if (proxy.empty() || !endpoint.starts_with(kTcp)) return endpoint;
    CHECK(!tunnel);  // sockets connect once
    const auto opened = home.open_tunnel(proxy, endpoint.substr(kTcp.size()), options.patience_s);
    if (!opened) return opened.error();
    tunnel = *opened;
    return tunnel->endpoint();
  }

  // Not for a proxy: it is the end of a tunnel, or of a simulated link on this machine.
  void warn_of_clear(const std::string& endpoint) {
    if (is_local(endpoint) || home.access.clear_allowed() || tunnel) return;
    const std::lock_guard lock(home.mutex);
    if (!std::exchange(home.warned_of_clear, true))
      log::warn("{}: {} is spoken to in clear, and may be anybody: --keys encrypts (--insecure: so it is wanted)", name,
                endpoint);
  }

  void watch_connections() {
    if (connections) return;
    connections =
        std::make_unique<Connections>(home.context, socket,
                                      Connections::Options{.name = name,
                                                           .most = options.most_connections,
                                                           .most_unread = most_unread_bytes(),
                                                           .guarded = guarded,
                                                           .publishes = kind == Kind::kPub,
                                                           .quiet_s = kind == Kind::kPull ? kQuietPusher_s : 1e300});
    home.watch().add(*connections);
  }
  Connections::Counts counts() const { return connections ? connections->counts() : Connections::Counts{}; }

  // Hangs up on connections whose key is on the list no more; those that come again are asked for their key.
  void close_revoked() {
    const auto now = home.doorkeeper->may_stay();
    if (now == may_stay) return;
    may_stay = now;
    for (const std::string& user : connections->keep_only(*now))
      log::warn("{}: a connection is closed: the key {} is on the allow-list no more", name,
                visitor_of(user).value_or(Visitor{}).name);
  }

  // To be called before messages are read, until no message is left.
  void begin_reading() {
    if (connections) connections->begin_reading();
    if (connections && guarded) close_revoked();
    attempts.look(tunnel);
  }

  // message: the last frame of a message that took `bytes` on the network.
  void note_spoken(zmq::message_t& message, uint64_t bytes) {
    if (!connections) return;
    const char* user = guarded ? zmq_msg_gets(message.handle(), "User-Id") : nullptr;
    connections->spoke(zmq_msg_get(message.handle(), ZMQ_SRCFD), bytes, user ? user : "");
  }

  // Counts a connection that ended without one whole message as rejected. To be called when no message is left.
  void end_reading() {
    if (connections && connections->judge() > 0)
      log_rejection("a connection", "it brought nothing that is a ZeroMQ message");
  }

  // Reads what viewers send to a publisher: subscriptions to everything, or their end.
  void drain_subscriptions() {
    zmq::message_t message;
    begin_reading();
    for (int n = 0; n < 1000; ++n) {
      try {
        if (!undisturbed([&] { return socket.recv(message, zmq::recv_flags::dontwait); })) return end_reading();
      } catch (const zmq::error_t&) {
        return;
      }
      const int from = zmq_msg_get(message.handle(), ZMQ_SRCFD);
      if (from < 0) continue;  // ZeroMQ unsubscribes for a connection that is gone
      note_spoken(message, wire_bytes(message.size()));
      const char first = message.size() ? *static_cast<const char*>(message.data()) : '?';
      if (message.size() == 1 && (first == 0 || first == 1)) continue;
      ++rejected;
      if (connections) connections->hang_up_on(from);  // ZeroMQ would keep its subscriptions
      log_rejection(fmt::format("a subscription of {} bytes", message.size()), "viewers subscribe to everything");
    }
  }

  void log_rejection(const std::string& what, const std::string& why) {
    const std::lock_guard lock(log_mutex);
    if (limiter.allow(monotonic_s())) {
      const std::string more =
          limiter.suppressed() ? fmt::format(" ({} more since the last such line)", limiter.suppressed()) : "";
      log::warn("{}: dropped {}: {}{}", name, telesplat::printable(what), telesplat::printable(why, 512), more);
    }
  }

  bool counts_queued() const { return kind == Kind::kRouter || kind == Kind::kPub; }

  // Subscribers share published messages: none of them waits for more bytes than all messages together that are not
  // sent to everyone yet.
  bool make_room(std::string_view peer, std::string_view type, size_t bytes) {
    if (kind == Kind::kPub && connections) {
      connections->published(wire_bytes(type.size()) + wire_bytes(bytes));
      if (!queued.has_room(peer, bytes)) queue_refused += connections->hang_up_on_late(options.most_queued_bytes / 2);
      return true;
    }
    if (queued.has_room(peer, bytes)) return true;
    ++queue_refused;
    log_rejection(fmt::format("message '{}' to peer '{}'", printable(type), printable(peer)),
                  fmt::format("{} bytes wait for it already (--queue-limit-mb)", queued.of(peer)));
    return false;
  }
  // Counts a frame with what ZMTP and CURVE add.
  uint64_t wire_bytes(size_t bytes) const {
    const uint64_t sent = bytes + (guarded ? 33 : 0);
    return sent + (sent > 255 ? 9 : 2);
  }

  // make(): returns the body; called only if the peer's queue takes it.
  template <class Make>
  bool send(std::string_view peer, std::string_view type, size_t bytes, const Make& make) {
    if (kind == Kind::kPub) drain_subscriptions();
    if (counts_queued() && !make_room(peer, type, bytes)) return false;
    try {
      using zmq::send_flags;
      const auto part = [&](std::string_view bytes) {
        return undisturbed([&] { return socket.send(zmq::buffer(bytes), send_flags::sndmore | send_flags::dontwait); });
      };
      // ZeroMQ's thread knows at once what a fast peer has read; this thread only after it reads the socket's events.
      const auto look = [&] { return undisturbed([&] { return socket.get(zmq::sockopt::events) >= 0; }); };
      if (kind == Kind::kRouter && !part(peer) && look() && !part(peer)) return false;
      if (!part(type)) return false;
      // ZeroMQ takes ownership of the body without copying it.
      struct Owned {
        std::string body;
        QueuedBytes::Ticket ticket;
      };
      std::string body = make();
      const size_t made = body.size();
      auto* owned =
          counts_queued() ? new Owned{std::move(body), queued.add(peer, made)} : new Owned{std::move(body), {}};
      const auto free = [](void* memory, void* hint) {
        was_handed_over(memory);
        delete static_cast<Owned*>(hint);
      };
      hand_over(owned->body.data());
      zmq::message_t frame(owned->body.data(), owned->body.size(), free, owned);
      return undisturbed([&] { return socket.send(frame, send_flags::dontwait); }).has_value();
    } catch (const zmq::error_t&) {  // EHOSTUNREACH: the peer is gone
      return false;
    }
  }

  bool send(std::string_view peer, std::string_view type, std::string& body) {
    return send(peer, type, body.size(), [&] { return std::move(body); });
  }

  std::optional<Message> receive() {
    if (kind == Kind::kPub) {
      drain_subscriptions();
      return std::nullopt;
    }
    begin_reading();
    // Reads at most 100 bad messages, so that a flood does not keep the caller from its other sockets.
    for (int bad = 0; bad < 100; ++bad) {
      std::vector<zmq::message_t> frames;
      uint64_t bytes = 0;
      try {
        do {
          zmq::message_t frame;
          if (!undisturbed([&] { return socket.recv(frame, zmq::recv_flags::dontwait); })) {
            end_reading();
            return std::nullopt;
          }
          const bool is_name = kind == Kind::kRouter && frames.empty();  // the routing id was not sent
          if (!is_name) bytes += wire_bytes(frame.size());
          if (frames.size() < 4) frames.push_back(std::move(frame));
        } while (socket.get(zmq::sockopt::rcvmore));
      } catch (const zmq::error_t& e) {
        log::error("{}: {}", name, e.what());
        return std::nullopt;
      }
      note_spoken(frames.back(), bytes);
      Message out;
      out.arrived_s = monotonic_s();
      size_t next = 0;
      if (kind == Kind::kRouter) out.peer = frames[next++].to_string();
      if (frames.size() != next + 2) {
        reject(out, fmt::format("{} frames instead of a type and a body", frames.size() - next));
        continue;
      }
      out.type = frames[next].to_string().substr(0, kMaxTypeBytes);
      struct Received {
        explicit Received(zmq::message_t message) : body(std::move(message)) {}
        zmq::message_t body;
        ~Received() { hand_over(body.data()); }  // gives it to the thread that frees memory
      };
      auto received = std::make_shared<Received>(std::move(frames[next + 1]));
      zmq::message_t& body = received->body;
      was_handed_over(body.data());
      if (guarded && !admit(out, body)) continue;
      if (body.size() > options.max_message_bytes) {
        reject(out, fmt::format("{} bytes, limit {}", body.size(), options.max_message_bytes));
        continue;
      }
      out.body = {static_cast<const std::byte*>(body.data()), body.size()};
      out.owner = std::move(received);
      return out;
    }
    return std::nullopt;
  }

  // Sets the sender's name and role. False: its role may not send this message.
  bool admit(Message& message, zmq::message_t& body) {
    const char* text = zmq_msg_gets(body.handle(), "User-Id");
    const auto visitor = visitor_of(text ? text : "");
    if (visitor) {
      message.user = visitor->name;
      message.role = visitor->role;
      if (!home.doorkeeper->may_stay()->contains(text)) {
        reject(message, fmt::format("the key {} is on the allow-list no more", visitor->name));
        return false;
      }
      if (may_send(visitor->role, options.serves, message.type)) return true;
    }
    const std::string who = visitor ? fmt::format("the key {} is {}'s", visitor->name, described(visitor->role))
                                    : std::string("nobody knows whose it is");
    reject(message, fmt::format("not allowed: {}", who));
    return false;
  }

  void reject(const Message& message, const std::string& why) {
    ++rejected;
    log_rejection(fmt::format("message '{}' from peer '{}'", printable(message.type), printable(message.peer)), why);
  }

  // Starts the thread that reads ahead, if the options ask for it.
  bool reads_ahead() {
    if (!options.read_ahead || ahead) return ahead != nullptr;
    CHECK(kind == Kind::kDealer || kind == Kind::kPull || kind == Kind::kSub);
    const ReadAhead::Ends ends{
        .receive = [this] { return receive(); },
        .send = [this](ReadAhead::Outgoing& o) { return send({}, o.type, o.body); },
        .wait =
            [this](int descriptor, int timeout_ms) {
              poll({{socket.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, descriptor, ZMQ_POLLIN, 0}}, timeout_ms);
            },
        .due = [this]() -> std::optional<ReadAhead::Outgoing> {
          auto message = due ? due() : std::nullopt;
          if (!message) return std::nullopt;
          return ReadAhead::Outgoing{std::move(message->first), std::move(message->second)};
        }};
    ahead = std::make_unique<ReadAhead>(ends, ReadAhead::Limits{.unsent = size_t(options.high_water_mark)});
    return true;
  }

  zmq::pollitem_t poll_item() {
    if (reads_ahead()) return {nullptr, ahead->descriptor(), ZMQ_POLLIN, 0};
    return {socket.handle(), 0, ZMQ_POLLIN, 0};
  }

  ZeroMq& home;
  Kind kind;
  std::string name;
  SocketOptions options;
  zmq::socket_t socket;
  std::unique_ptr<Connections> connections;  // only if the socket binds
  Attempts attempts;                         // only if it connects, with watch_connecting
  Socket::Due due;                           // returns messages that the reading thread sends by itself
  std::atomic<uint64_t> rejected{0}, queue_refused{0};
  Tunnel* tunnel = nullptr;  // only if it connects through a proxy; owned by the context
  QueuedBytes queued{options.most_queued_bytes};
  bool guarded = false;                                   // it is bound with keys
  std::shared_ptr<const std::set<std::string>> may_stay;  // peers that the allow-list let in at the last look
  std::string endpoint;                                   // address that it connects to
  std::mutex log_mutex;  // guards the limiter: with read_ahead two threads may refuse messages
  log::RateLimiter limiter;
  std::unique_ptr<ReadAhead> ahead;  // with read_ahead, from the first message on; destroyed first
};

class ZeroMqCarrier final : public Carrier {
 public:
  ZeroMqCarrier(ZeroMq& home, Kind kind, std::string name, const SocketOptions& options)
      : parts_(home, kind, std::move(name), options) {}

  Result<std::string> bind(const std::string& endpoint, bool insecure) override;
  Status connect(const std::string& endpoint) override;
  bool send(std::string_view peer, std::string_view type, uint64_t bytes,
            const std::function<std::string()>& make) override {
    if (parts_.reads_ahead()) return parts_.ahead->send({std::string(type), make()});
    return parts_.send(peer, type, bytes, make);
  }
  void set_due(Socket::Due due) override {
    CHECK(parts_.options.read_ahead && !parts_.ahead);
    parts_.due = std::move(due);
  }
  std::optional<Message> receive() override {
    return parts_.reads_ahead() ? parts_.ahead->receive() : parts_.receive();
  }
  std::optional<bool> readable() override { return std::nullopt; }
  zmq::pollitem_t poll_item() { return parts_.poll_item(); }
  void reject(const Message& message, const std::string& why) override { parts_.reject(message, why); }

  uint64_t rejected() override {
    if (parts_.kind == Kind::kPub) parts_.drain_subscriptions();
    return parts_.rejected + parts_.counts().silent;
  }
  uint64_t failed_connections() override {
    if (!parts_.ahead) parts_.attempts.look(parts_.tunnel);
    return parts_.attempts.failed;
  }
  uint64_t keys_refused() override { return parts_.counts().keys_refused; }
  uint64_t connections_refused() override { return parts_.counts().refused; }
  uint64_t queued_bytes(std::string_view peer) override { return parts_.queued.of(peer); }
  uint64_t queue_refused() override { return parts_.queue_refused; }
  Socket::Refusal refusal() override;
  bool in_touch() override {
    if (!parts_.ahead) parts_.attempts.look(parts_.tunnel);
    return parts_.attempts.in_touch;
  }
  bool tunnelled() override { return parts_.tunnel != nullptr; }
  const std::string& name() const override { return parts_.name; }
  bool reads_ahead() const override { return parts_.options.read_ahead; }

 private:
  Parts parts_;
};

std::unique_ptr<Carrier> ZeroMq::open(Kind kind, std::string name, const SocketOptions& options) {
  return std::make_unique<ZeroMqCarrier>(*this, kind, std::move(name), options);
}

Result<std::string> ZeroMqCarrier::bind(const std::string& endpoint, bool insecure) {
  CHECK(!parts_.ahead);
  const Keys* keys = parts_.home.access.keys();
  if (!insecure && !keys && !is_local(endpoint))
    return Error{fmt::format("{}: {} is not a loopback or ipc address; others need --keys, or --insecure", parts_.name,
                             endpoint)};
  try {
    if (keys) {
      if (keys->server_secret.empty() || parts_.options.serves.empty())
        return Error{fmt::format("{}: its keys are not for binding", parts_.name)};
      if (const Status s = parts_.home.let_in(); !s) return Error{fmt::format("--keys {}", s.error().text)};
      guard(parts_.socket, *keys, parts_.options.serves);
      parts_.guarded = true;
    }
    parts_.watch_connections();
    parts_.socket.set(zmq::sockopt::handshake_ivl, int(kHandshake_s * 1e3));
    if (is_ipv6(endpoint)) parts_.socket.set(zmq::sockopt::ipv6, 1);
    parts_.socket.bind(numeric_host(endpoint));
    return parts_.socket.get(zmq::sockopt::last_endpoint);
  } catch (const zmq::error_t& e) {
    const char* const hint =
        e.num() == ENODEV ? "; an address of this machine, * or the name of a network interface is meant" : "";
    return Error{fmt::format("{}: cannot bind to {}: {}{}", parts_.name, endpoint, e.what(), hint)};
  }
}

Status ZeroMqCarrier::connect(const std::string& endpoint) {
  CHECK(!parts_.ahead);
  try {
    if (parts_.options.watch_connecting && !parts_.connections)
      parts_.attempts.watch(parts_.home.context, parts_.socket);
    if (const Keys* keys = parts_.home.access.keys()) {
      if (!keys->own) return Error{fmt::format("{}: its keys are not for connecting", parts_.name)};
      identify(parts_.socket, *keys);
    }
    const auto way = parts_.way_to(endpoint);
    if (!way) return Error{fmt::format("{}: {}", parts_.name, way.error().text)};
    if (!parts_.home.access.keys()) parts_.warn_of_clear(endpoint);
    if (is_ipv6(*way)) parts_.socket.set(zmq::sockopt::ipv6, 1);
    parts_.endpoint = numeric_host(*way);
    parts_.socket.connect(parts_.endpoint);
    return ok_status();
  } catch (const zmq::error_t& e) {
    return Error{fmt::format("{}: cannot connect to {}: {}", parts_.name, endpoint, e.what())};
  }
}

Socket::Refusal ZeroMqCarrier::refusal() {
  if (!parts_.ahead) parts_.attempts.look(parts_.tunnel);
  const Keys* keys = parts_.home.access.keys();
  if (keys && parts_.attempts.turned_away == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH)
    return {.text =
                fmt::format("the key {} of {} is not let in there", keys->own ? keys->own->name : "", keys->folder)};
  const bool broken_off = parts_.attempts.broken_off >= kBrokenOff;
  if (!keys && broken_off && !parts_.tunnel) parts_.attempts.look_for_mechanism(parts_.endpoint);
  const bool turned_away = parts_.attempts.turned_away != 0;
  if (!turned_away && !broken_off) return {};
  if (keys)
    return {.text = fmt::format("it does not take the keys of {}: it has others, or none", keys->folder),
            .may_pass = !turned_away};
  return {.text = turned_away ? "it wants a key (--keys DIR)"
                              : "it breaks off connections, as one that wants a key does (--keys DIR), or that has as "
                                "many as it takes (--max-connections)",
          .may_pass = !turned_away};
}

}  // namespace

std::unique_ptr<Network> make_zeromq(Access access) { return std::make_unique<ZeroMq>(std::move(access)); }

bool wait_readable(const std::vector<Socket*>& sockets, int timeout_ms) {
  std::vector<zmq::pollitem_t> items;
  for (const Socket* s : sockets) {
    if (const auto readable = s->carrier().readable()) {
      if (*readable) return true;
    } else {
      items.push_back(static_cast<ZeroMqCarrier&>(s->carrier()).poll_item());
    }
  }
  if (items.empty() && !sockets.empty()) return false;
  return poll(std::move(items), timeout_ms);
}
bool wait_readable_s(const std::vector<Socket*>& sockets, double timeout_s) {
  const double until_s = monotonic_s() + timeout_s;
  if (wait_readable(sockets, static_cast<int>(timeout_s * 1e3))) return true;
  const double rest_s = std::min(until_s - monotonic_s(), 1e-3);  // ZeroMQ counts whole milliseconds
  if (rest_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(rest_s));
  return false;
}

}  // namespace telesplat::net
