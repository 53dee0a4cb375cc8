// Signs of life, and who asks for them.
#pragma once

#include <zmq.hpp>

namespace telesplat::net {

/// To be called before a socket binds: it asks nobody for signs of life. ZeroMQ 4.3 ends the process if it is time for
/// one over a connection that broke while what came over it waited to be read (libzmq/issues/4841); and what comes, and
/// when it breaks, is up to others. Who connects to it sends signs of life and says how long without one is too long;
/// of who does not, or whose machine is gone, TCP tells within a minute.
inline void without_heartbeats(zmq::socket_t& socket) {
  socket.set(zmq::sockopt::heartbeat_ivl, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, 15);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, 10);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, 4);
}

}  // namespace telesplat::net
