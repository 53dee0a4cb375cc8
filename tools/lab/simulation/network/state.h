// A simulated network's inside: time (network.cpp), connections (connections.cpp), sockets (sockets.cpp). Private to
// this library.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/lab/simulation/network/pipes.h"

namespace telesplat::simulation {

class SimulatedNetwork::State {
 public:
  State(SimulatedNetwork& owner, uint64_t seed);

  using Action = std::function<void()>;
  /// Something that happens in a process, once it runs; never, if it has crashed. process -1: in a kernel.
  void at(double when_s, int process, Action action);
  double draw();  ///< from 0 to below 1
  const LinkOptions& link(int from, int to) const;
  bool frozen(const SimulatedSocket& s);
  void run_next();

  void crash(int process);
  void go_on(int process);
  void break_connections(int a, int b);
  void silence(int a, int b, double for_s);
  void forget_closed();

  // Connections.
  Result<std::string> bind(SimulatedSocket& s, const std::string& endpoint);
  void connect(SimulatedSocket& s, const std::string& endpoint);
  void close(SimulatedSocket& s);
  void push_out(End& e);       // what waits goes to the kernel, as far as it takes it
  void go_on_sending(End& e);  // there is room
  void take_in(End& e);        // what the kernel has goes to the queue, as far as it takes it
  void hang_up(End& e);        // counted as refused
  void lost(End& e);           // it learns that its connection is over

  // Sockets.
  bool send(SimulatedSocket& s, std::string_view peer, std::string_view type, uint64_t bytes,
            const std::function<std::string()>& make);
  std::optional<net::Message> receive(SimulatedSocket& s);
  bool readable(SimulatedSocket& s);
  void reject(SimulatedSocket& s, const net::Message& message, const std::string& why);
  void send_unsent(SimulatedSocket& s);
  void read_ahead(SimulatedSocket& s);

  struct ProcessState {
    ProcessOptions options;
    bool stopped = false, crashed = false;
    std::vector<Action> held = {};  // what happens once it goes on
  };
  struct Event {
    int process;
    Action action;
  };
  struct Silence {
    double since_s = 0, until_s = -1;
  };

  SimulatedNetwork& owner;
  double now_s = 0;
  uint64_t messages = 0;
  LinkOptions links;  // that have none of their own
  std::map<std::pair<int, int>, LinkOptions> own_links;
  std::map<int, ProcessState> processes;
  std::map<std::pair<double, uint64_t>, Event> events;  // by time, then number
  std::vector<std::shared_ptr<SimulatedSocket>> sockets;

 private:
  std::shared_ptr<SimulatedSocket> shared(const SimulatedSocket& s) const;
  bool is_silent(int a, int b) const;
  // At a connection's other end (ends[side]), or once bytes get there again.
  void on_wire(const std::shared_ptr<Wire>& wire, int side, double when_s, Action action);
  void arrive(Wire& wire, int side);
  void finish(const std::shared_ptr<Wire>& wire, int side);

  void retry(End& e, bool was_refused);
  void attempt(const std::weak_ptr<End>& end);
  void accept(const std::weak_ptr<End>& end);
  std::string refusal(const SimulatedSocket& connects, SimulatedSocket& bound);
  void shake_hands(const std::shared_ptr<End>& end, SimulatedSocket& bound);
  void close_end(End& e);
  void drop_all(End& e);

  void passed(Passed::What what, const Parcel& parcel, int to);
  void refuse(const SimulatedSocket& s, std::string_view type);
  Parcel made(SimulatedSocket& s, std::string_view type, std::string body);
  bool offer(SimulatedSocket& s, const std::function<Parcel()>& make);
  bool route(SimulatedSocket& s, std::string_view peer, std::string_view type, uint64_t bytes,
             const std::function<Parcel()>& make);
  bool publish(SimulatedSocket& s, std::string_view type, uint64_t bytes, const std::function<Parcel()>& make);
  void start_reading(SimulatedSocket& s);
  void ask_due(const std::weak_ptr<SimulatedSocket>& socket);
  std::optional<net::Message> take(SimulatedSocket& s);

  uint64_t random_;
  uint64_t numbers_ = 0;  // number of events
  uint32_t peers_ = 0;
  int ports_ = 20000;
  std::map<std::pair<int, int>, Silence> silences_;  // the lower number first
  std::map<std::string, SimulatedSocket*> bound_;    // by port, or endpoint
};

}  // namespace telesplat::simulation
