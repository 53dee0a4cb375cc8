// Events that ZeroMQ reports about a socket's connections. Private to this library.
#pragma once

#include <zmq.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

namespace telesplat::net {

// Calls of ZeroMQ that signals may interrupt. Private to this library.

/// Repeats a call of ZeroMQ, one that does not wait, until no signal interrupts it: giving up between two parts of a
/// message would tear the message.
template <class Call>
auto undisturbed(const Call& call) {
  for (;;) {
    try {
      return call();
    } catch (const zmq::error_t& e) {
      if (e.num() != EINTR) throw;
    }
  }
}

// Detection of dead connections.

/// To be called before a socket binds or connects: TCP keeps watch over its connections. One whose other end does not
/// answer for about patience_s counts as broken; the kernel of a process that stands still answers for it. ZeroMQ's own
/// heartbeats are off: ZeroMQ 4.3 ends the process if one is due over a connection that broke while bytes of it waited
/// to be read (libzmq/issues/4841); and peers decide about both.
inline void look_after(zmq::socket_t& socket, double patience_s) {
  constexpr int kIdle_s = 5, kApart_s = 5;
  socket.set(zmq::sockopt::heartbeat_ivl, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kIdle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kApart_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, std::max(1, static_cast<int>(patience_s - kIdle_s) / kApart_s));
  socket.set(zmq::sockopt::tcp_maxrt, static_cast<int>(patience_s * 1e3));
}

/// Reads a socket's events. Several threads may use it, one at a time; `socket` must outlive it.
class Monitor {
 public:
  struct Event {
    uint16_t what = 0;  ///< ZMQ_EVENT_ACCEPTED and so on
    int32_t value = 0;  ///< for most events, a file descriptor
  };

  /// events: those to report, combined by "or".
  Monitor(zmq::context_t& context, zmq::socket_t& socket, int events)
      : watched_(socket.handle()), told_(context, zmq::socket_type::pair) {
    static std::atomic<int> counter{0};
    const std::string address = "inproc://monitor-" + std::to_string(++counter);
    told_.set(zmq::sockopt::linger, 0);
    told_.set(zmq::sockopt::rcvhwm, 0);  // a queue that is full would stop ZeroMQ's thread
    if (zmq_socket_monitor(watched_, address.c_str(), events) == 0) told_.connect(address);
  }
  /// Stops ZeroMQ from making events while told_ can still take them.
  ~Monitor() { zmq_socket_monitor(watched_, nullptr, 0); }
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Returns the next event without waiting.
  std::optional<Event> next() {
    zmq::message_t event, address;
    while (undisturbed([&] { return told_.recv(event, zmq::recv_flags::dontwait); })) {
      if (event.more() && undisturbed([&] { return told_.recv(address); })) {
      }
      if (event.size() < 6) continue;
      Event out;
      std::memcpy(&out.what, event.data(), 2);
      std::memcpy(&out.value, static_cast<const char*>(event.data()) + 2, 4);
      return out;
    }
    return std::nullopt;
  }
  /// Becomes readable after next() returned nothing and an event came.
  int descriptor() { return told_.get(zmq::sockopt::fd); }

 private:
  void* watched_;
  zmq::socket_t told_;
};

}  // namespace telesplat::net
