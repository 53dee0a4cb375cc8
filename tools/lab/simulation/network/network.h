// A network in one process, with a clock that its owner moves: sockets of common/net rest on it as they rest on ZeroMQ,
// and keep, drop and refuse messages as ZeroMQ 4.3 does over TCP. tests/simulation/network_conformance_test.cpp runs
// the same tests on both. Nothing here asks for real time or has threads.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/net/carrier.h"

namespace telesplat::simulation {

/// One direction between two processes.
struct LinkOptions {
  double latency_s = 0.0005;
  double jitter_s = 0;               ///< a message takes up to this much longer; drawn for each
  double bytes_s = 0;                ///< rate; 0: no limit
  uint64_t buffer_bytes = 4u << 20;  ///< what the two kernels keep of a connection; as measured over loopback
};

/// The key that a process shows, as its allow-list would name it.
struct Identity {
  std::string user;
  net::Role role = net::Role::kServer;
};

struct ProcessOptions {
  /// The process' clock at a time of the network, in s. Empty: the same.
  std::function<double(double network_s)> clock = {};
  /// Calls what is to run as this process: Socket::Due. Empty: calls it.
  std::function<void(const std::function<void()>&)> run = {};
  /// With a key, bound sockets let in processes whose role may connect (keys/roles.h). Nothing: no keys.
  std::optional<Identity> key = {};
};

/// A message that was sent, came, or was lost.
struct Passed {
  enum class What : uint8_t { kSent, kDelivered, kDropped };
  What what = What::kSent;
  double sent_s = 0, now_s = 0;  ///< the network's time
  int from = -1, to = -1;        ///< processes; to: -1 where the receiver is not known
  net::Kind kind{};              ///< the sender's socket
  std::string_view socket, type;
  wire::Bytes body;  ///< empty where a message was refused before it was made
};

class SimulatedNetwork {
 public:
  /// seed: of jitter and of waits before reconnecting.
  explicit SimulatedNetwork(uint64_t seed);
  /// Sockets must be gone by then.
  ~SimulatedNetwork();

  /// Makes the network of a process' net::Context. process: a number for one life of one process, from 0.
  std::unique_ptr<net::Network> attach(int process, ProcessOptions options = {});

  /// Options of all links but those of set_link().
  void set_links(const LinkOptions& options);
  /// Holds for what is sent from now on.
  void set_link(int from, int to, const LinkOptions& options);

  double now_s() const;
  /// When something happens next; infinity: nothing does.
  double next_s() const;
  /// Moves the clock to now_s, which does not go back, and delivers in order what arrives until then. Callbacks must
  /// not call it.
  void advance(double now_s);

  /// SIGKILL. What is on the wire still arrives; all else of the process is lost. Its objects may live on: their calls
  /// do nothing. Connected processes learn of it a latency later.
  void crash(int process);
  /// SIGSTOP, SIGCONT. A stopped process' kernel goes on taking bytes; nothing else happens in it.
  void stop(int process);
  void go_on(int process);
  /// Resets all connections between the two: what is on the wire is lost.
  void break_connections(int a, int b);
  /// From now on, nothing arrives in either direction for `for_s`. An end whose SocketOptions::patience_s ends before
  /// takes its connection for broken; otherwise bytes arrive late.
  void silence(int a, int b, double for_s);

  /// Is called for each message; with kSent before it is queued. It may crash and stop processes, also the sender. It
  /// must call nothing else of the network.
  std::function<void(const Passed&)> on_passed;
  /// A socket of the process has become readable. It may be called more often.
  std::function<void(int process)> on_ready;
  /// Returns the time, s, that the process whose turn it is has worked since now_s(): its messages leave that much
  /// later. Empty: 0.
  std::function<double()> ahead_s;
  /// A process refuses a message that came.
  std::function<void(int process, std::string_view socket, const net::Message& message, const std::string& why)>
      on_rejected;
  /// Messages that sockets took to be sent.
  uint64_t messages() const;

  class State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace telesplat::simulation
