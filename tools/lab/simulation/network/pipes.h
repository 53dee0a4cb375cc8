// Parts of a simulated network: queues, connections and sockets, as ZeroMQ has them. Private to this library.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/net/carrier.h"
#include "common/net/connections/queued_bytes.h"
#include "common/net/read_ahead.h"
#include "tools/lab/simulation/network/network.h"

namespace telesplat::simulation {

struct Sender {
  int process;
  net::Kind kind;
  std::string name;
};

/// A message on its way; subscribers share its body.
struct Parcel {
  std::shared_ptr<const Sender> from;
  std::string type;
  std::shared_ptr<const std::string> body;
  std::shared_ptr<const net::QueuedBytes::Ticket> ticket = {};  // until it is on the wire
  double sent_s = 0;
  uint64_t bytes() const { return type.size() + body->size() + 4; }
};

/// A queue of messages with a high-water mark. Its writer learns what was taken in steps of half the mark.
class Pipe {
 public:
  explicit Pipe(int mark) : mark_(uint64_t(mark)) {}
  bool full() const { return mark_ > 0 && pushed_ - told_ >= mark_; }
  bool empty() const { return parcels_.empty(); }
  uint64_t bytes() const { return bytes_; }
  void push(Parcel parcel) {
    ++pushed_, bytes_ += parcel.bytes();
    parcels_.push_back(std::move(parcel));
  }
  Parcel pop() {
    Parcel out = std::move(parcels_.front());
    parcels_.pop_front();
    bytes_ -= out.bytes();
    if (++popped_ % ((mark_ + 1) / 2 + (mark_ == 0)) == 0) told_ = popped_;
    return out;
  }

 private:
  uint64_t mark_, pushed_ = 0, popped_ = 0, told_ = 0, bytes_ = 0;
  std::deque<Parcel> parcels_;
};

struct End;
struct SimulatedSocket;

/// One direction of a TCP connection.
struct Way {
  std::deque<Parcel> flying, arrived;  // arrived: in the receiver's kernel
  uint64_t bytes = 0;                  // flying and arrived
  double free_s = 0, last_s = 0;       // when the sender's link is free; when the last byte arrives
  bool finished = false;               // the receiver's kernel knows that nothing more comes
};

/// A TCP connection: ends[0] connected, ends[1] accepted; ways[i] leads from ends[i].
struct Wire {
  int process[2];
  End* ends[2];  // null: closed
  Way ways[2] = {};
};

/// A socket's end of one connection. The end of a socket that connects outlives TCP's connections.
struct End {
  SimulatedSocket& socket;
  int side;  // 0: connected, 1: accepted
  Pipe out, in;
  std::string endpoint = {};          // side 0
  std::string peer = {};              // side 1: routing id
  std::optional<Identity> key = {};   // side 1: the other process' key
  std::shared_ptr<Wire> wire = {};    // null: not connected
  bool up = false;                    // it may send
  bool gone = false;                  // side 1: the connection is over; what came is still read
  bool spoken = false;                // side 1: a message came
  double since_s = 0;                 // side 1
  double reconnect_s = 0.05;          // side 0: what ZMQ_RECONNECT_IVL has become
  uint64_t published = 0, taken = 0;  // side 1 of a publisher: bytes
};

struct SimulatedSocket {
  std::shared_ptr<const Sender> self;
  net::SocketOptions options;
  std::string serves;
  net::QueuedBytes queued{options.most_queued_bytes};
  std::vector<std::shared_ptr<End>> ends = {};
  size_t next_in = 0, next_out = 0;  // whose turn it is
  bool dead = false;                 // its process crashed
  bool closing = false;              // its owner destroyed it; what is left to send lingers

  // With read_ahead, as net::ReadAhead has it.
  bool reads = false;          // its thread runs
  bool reading_ahead = false;  // just now
  std::deque<net::Message> received = {};
  size_t received_bytes = 0;
  std::deque<Parcel> unsent = {};
  net::Socket::Due due = {};

  uint64_t rejected = 0, failed_connections = 0, keys_refused = 0, connections_refused = 0, queue_refused = 0;
  bool in_touch = false;
  int broken_off = 0;  // handshakes, one after the other
  std::string refused = {};
  double looked_for_late_s = -1e300;
  log::RateLimiter limiter = {};
};

}  // namespace telesplat::simulation
