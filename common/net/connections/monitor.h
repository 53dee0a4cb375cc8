// What ZeroMQ tells of a socket's connections. Private to this library.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <zmq.hpp>

#include "common/net/connections/undisturbed.h"

namespace telesplat::net {

/// Several threads may use it, one at a time; `socket` must outlive it.
class Monitor {
 public:
  struct Event {
    uint16_t what = 0;  ///< ZMQ_EVENT_ACCEPTED and so on
    int32_t value = 0;  ///< for most, a file descriptor
  };

  /// events: those that are told of, together.
  Monitor(zmq::context_t& context, zmq::socket_t& socket, int events)
      : watched_(socket.handle()), told_(context, zmq::socket_type::pair) {
    static std::atomic<int> counter{0};
    const std::string address = "inproc://monitor-" + std::to_string(++counter);
    told_.set(zmq::sockopt::linger, 0);
    told_.set(zmq::sockopt::rcvhwm, 0);  // a queue that is full would stop ZeroMQ's thread
    if (zmq_socket_monitor(watched_, address.c_str(), events) == 0) told_.connect(address);
  }
  /// ZeroMQ's thread must find someone who takes its events until it stops to make them.
  ~Monitor() { zmq_socket_monitor(watched_, nullptr, 0); }
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Without waiting.
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
  /// Becomes readable when next() has something, once it had nothing.
  int descriptor() { return told_.get(zmq::sockopt::fd); }

 private:
  void* watched_;
  zmq::socket_t told_;
};

}  // namespace telesplat::net
