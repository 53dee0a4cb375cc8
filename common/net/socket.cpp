#include "common/net/socket.h"

#include <fmt/format.h>

#include <atomic>
#include <random>
#include <zmq.hpp>

#include "common/core/clock.h"

namespace telesplat::net {
namespace {

constexpr int64_t kDisconnectBytes = static_cast<int64_t>(wire::kMaxBulkBytes) + (2 << 20);
constexpr size_t kMaxTypeBytes = 64;

zmq::socket_type zmq_type(Kind kind) {
  switch (kind) {
    case Kind::kRouter: return zmq::socket_type::router;
    case Kind::kDealer: return zmq::socket_type::dealer;
    case Kind::kPush: return zmq::socket_type::push;
    case Kind::kPull: return zmq::socket_type::pull;
    case Kind::kPub: return zmq::socket_type::pub;
    case Kind::kSub: return zmq::socket_type::sub;
  }
  return zmq::socket_type::dealer;
}

bool is_local(const std::string& endpoint) {
  for (const char* prefix : {"ipc://", "inproc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
    if (endpoint.starts_with(prefix)) return true;
  return false;
}

// For log lines: routing ids are binary.
std::string printable(std::string_view bytes) {
  std::string out;
  for (unsigned char c : bytes.substr(0, 24)) out += c >= 32 && c < 127 ? std::string(1, char(c)) : fmt::format("\\x{:02x}", c);
  return out;
}

}  // namespace

struct Context::Impl {
  zmq::context_t context{1};
};

Context::Context() : impl_(std::make_unique<Impl>()) {}
Context::~Context() = default;

struct Socket::Impl {
  Impl(zmq::context_t& context, Kind kind, std::string name, const SocketOptions& options)
      : context(context), kind(kind), name(std::move(name)), options(options), socket(context, zmq_type(kind)) {
    socket.set(zmq::sockopt::sndhwm, options.high_water_mark);
    socket.set(zmq::sockopt::rcvhwm, options.high_water_mark);
    socket.set(zmq::sockopt::maxmsgsize, kDisconnectBytes);
    socket.set(zmq::sockopt::linger, 500);
    socket.set(zmq::sockopt::reconnect_ivl, 50);
    socket.set(zmq::sockopt::reconnect_ivl_max, 500);
    socket.set(zmq::sockopt::heartbeat_ivl, 2000);
    socket.set(zmq::sockopt::heartbeat_timeout, 10000);
    if (kind == Kind::kSub) socket.set(zmq::sockopt::subscribe, "");
    if (kind == Kind::kRouter) socket.set(zmq::sockopt::router_mandatory, 1);
  }

  // Peers that fail their handshake (random bytes, another protocol) are seen by a monitor only.
  void watch_handshakes() {
    static std::atomic<int> counter{0};
    const std::string address = fmt::format("inproc://monitor-{}", ++counter);
    const int events = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
    if (zmq_socket_monitor(socket.handle(), address.c_str(), events) != 0) return;
    monitor.emplace(context, zmq::socket_type::pair);
    monitor->set(zmq::sockopt::linger, 0);
    monitor->connect(address);
  }

  void drain_monitor() {
    if (!monitor) return;
    zmq::message_t event, address;
    while (monitor->recv(event, zmq::recv_flags::dontwait)) {
      if (event.more() && monitor->recv(address)) {}
      ++rejected;
      log_rejection("a peer that failed its handshake", "not a ZeroMQ peer of ours");
    }
  }

  void log_rejection(const std::string& what, const std::string& why) {
    if (limiter.allow(monotonic_s())) {
      const std::string more = limiter.suppressed() ? fmt::format(" ({} more since the last such line)", limiter.suppressed()) : "";
      log::warn("{}: dropped {}: {}{}", name, what, why, more);
    }
  }

  zmq::context_t& context;
  Kind kind;
  std::string name;
  SocketOptions options;
  zmq::socket_t socket;
  std::optional<zmq::socket_t> monitor;
  uint64_t rejected = 0;
  log::RateLimiter limiter;
};

Socket::Socket(Context& context, Kind kind, std::string name, const SocketOptions& options)
    : impl_(std::make_unique<Impl>(context.impl().context, kind, std::move(name), options)) {}
Socket::~Socket() = default;
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;

Result<std::string> Socket::bind(const std::string& endpoint, bool insecure) {
  if (!insecure && !is_local(endpoint))
    return Error{fmt::format("{}: {} is not a loopback or ipc address; others need --insecure", impl_->name, endpoint)};
  try {
    impl_->watch_handshakes();
    impl_->socket.bind(endpoint);
    return impl_->socket.get(zmq::sockopt::last_endpoint);
  } catch (const zmq::error_t& e) {
    return Error{fmt::format("{}: cannot bind to {}: {}", impl_->name, endpoint, e.what())};
  }
}

Status Socket::connect(const std::string& endpoint) {
  try {
    impl_->socket.connect(endpoint);
    return ok_status();
  } catch (const zmq::error_t& e) {
    return Error{fmt::format("{}: cannot connect to {}: {}", impl_->name, endpoint, e.what())};
  }
}

void Socket::disconnect(const std::string& endpoint) {
  try {
    impl_->socket.disconnect(endpoint);
  } catch (const zmq::error_t&) {  // was not connected: that is what we want
  }
}

bool Socket::send_frames(std::string_view peer, std::string_view type, std::string body) {
  try {
    using zmq::send_flags;
    auto& s = impl_->socket;
    if (impl_->kind == Kind::kRouter && !s.send(zmq::buffer(peer), send_flags::sndmore | send_flags::dontwait)) return false;
    if (!s.send(zmq::buffer(type), send_flags::sndmore | send_flags::dontwait)) return false;
    // ZeroMQ takes the body over without copying it.
    auto* owned = new std::string(std::move(body));
    zmq::message_t frame(owned->data(), owned->size(), [](void*, void* hint) { delete static_cast<std::string*>(hint); }, owned);
    return s.send(frame, send_flags::dontwait).has_value();
  } catch (const zmq::error_t&) {  // EHOSTUNREACH: the peer is gone
    return false;
  }
}

std::optional<Message> Socket::receive() {
  impl_->drain_monitor();
  // A flood of bad messages must not keep the caller from its other sockets.
  for (int bad = 0; bad < 100; ++bad) {
    std::vector<zmq::message_t> frames;
    try {
      do {
        zmq::message_t frame;
        if (!impl_->socket.recv(frame, zmq::recv_flags::dontwait)) return std::nullopt;
        if (frames.size() < 4) frames.push_back(std::move(frame));
      } while (impl_->socket.get(zmq::sockopt::rcvmore));
    } catch (const zmq::error_t& e) {
      if (e.num() == EINTR) continue;
      log::error("{}: {}", impl_->name, e.what());
      return std::nullopt;
    }
    Message out;
    size_t next = 0;
    if (impl_->kind == Kind::kRouter) out.peer = frames[next++].to_string();
    if (frames.size() != next + 2) {
      reject(out, fmt::format("{} frames instead of a type and a body", frames.size() - next));
      continue;
    }
    out.type = frames[next].to_string().substr(0, kMaxTypeBytes);
    auto body = std::make_shared<zmq::message_t>(std::move(frames[next + 1]));
    if (body->size() > impl_->options.max_message_bytes) {
      reject(out, fmt::format("{} bytes, limit {}", body->size(), impl_->options.max_message_bytes));
      continue;
    }
    out.body = {static_cast<const std::byte*>(body->data()), body->size()};
    out.owner = std::move(body);
    return out;
  }
  return std::nullopt;
}

void Socket::reject(const Message& message, const std::string& why) {
  ++impl_->rejected;
  impl_->log_rejection(fmt::format("message '{}' from peer '{}'", printable(message.type), printable(message.peer)), why);
}

uint64_t Socket::rejected() const {
  impl_->drain_monitor();
  return impl_->rejected;
}
const std::string& Socket::name() const { return impl_->name; }

bool wait_readable(const std::vector<Socket*>& sockets, int timeout_ms) {
  std::vector<zmq::pollitem_t> items;
  for (const Socket* s : sockets) items.push_back({s->impl().socket.handle(), 0, ZMQ_POLLIN, 0});
  try {
    return zmq::poll(items, std::chrono::milliseconds(timeout_ms)) > 0;
  } catch (const zmq::error_t&) {  // EINTR: a signal; the caller looks at its stop flag
    return false;
  }
}

InstanceId make_instance_id() {
  std::random_device random;
  // 53 bits, so that ids survive tools that read numbers as doubles.
  return {(((uint64_t{random()} << 32) | random()) & ((uint64_t{1} << 53) - 1)) | 1};
}

}  // namespace telesplat::net
