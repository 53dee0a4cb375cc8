// Connections over which nothing comes any more.
#pragma once

#include <algorithm>
#include <zmq.hpp>

namespace telesplat::net {

/// To be called before a socket binds or connects: TCP looks after its connections. One whose other end does not
/// answer for about patience_s is taken for broken; a process that stands still answers, its kernel does.
/// ZeroMQ's own heartbeats are off. ZeroMQ 4.3 ends the process if it is time for one over a connection that broke
/// while what came over it waited to be read (libzmq/issues/4841); and what comes, and when it breaks, is up to others.
inline void look_after(zmq::socket_t& socket, double patience_s) {
  constexpr int kIdle_s = 5, kApart_s = 5;
  socket.set(zmq::sockopt::heartbeat_ivl, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kIdle_s);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kApart_s);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, std::max(1, static_cast<int>(patience_s - kIdle_s) / kApart_s));
  socket.set(zmq::sockopt::tcp_maxrt, static_cast<int>(patience_s * 1e3));
}

}  // namespace telesplat::net
