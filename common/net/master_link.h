// The client side of the master, the same for data, sampler, packer, viewer and ctl: hello until welcomed, a status
// report a second, hello again when the master asks, what the master's clock says, shutdown. While its owner works and
// does not tick, the thread that reads the socket says that the process lives.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/net/connections/waiting.h"
#include "common/net/socket.h"

namespace telesplat::net {

// How another machine's clock goes, from exchanges of messages with it (NTP, RFC 5905: on-wire protocol and clock
// filter): the exchange with the shortest round trip tells the offset best, since its two ways can differ least. No
// sockets, no clocks.

/// An exchange: a message to the other machine and its answer. Seconds, each of the clock of where it happened.
struct ClockExchange {
  double sent_s = 0, received_s = 0;    ///< the message: here, there
  double replied_s = 0, arrived_s = 0;  ///< the answer: there, here
  double round_trip_s() const { return (arrived_s - sent_s) - (replied_s - received_s); }
  double offset_s() const { return ((received_s - sent_s) + (replied_s - arrived_s)) / 2; }
};

class ClockEstimate {
 public:
  static constexpr double kMemory_s = 300;     ///< older exchanges are forgotten
  static constexpr double kDriftAfter_s = 20;  ///< exchanges must lie so far apart to tell the drift
  /// What two clocks may drift apart as long as nothing is known of it, and what they may wander from a drift that is
  /// known (RFC 5905's PHI): seconds a second.
  static constexpr double kUnknownDrift = 100e-6, kWander = 15e-6;

  /// Exchanges that no clocks could have brought about (a negative round trip, times that are not finite) are ignored.
  void add(const ClockExchange& exchange);
  void clear();
  /// It is one and the same clock: nothing has to be estimated any more, until clear().
  void same_clock() { same_ = true; }

  bool known() const { return same_ || !exchanges_.empty(); }
  /// The other clock minus this one, at this moment of this one; 0 while nothing is known.
  double offset_s(double local_s) const;
  /// By how much offset_s() may be wrong: half the round trip it rests on, and what may have come since. Infinite while
  /// nothing is known.
  double error_s(double local_s) const;
  /// Seconds a second by which the other clock is faster; 0 while that is not known.
  double drift() const { return same_ ? 0 : drift_; }
  /// The shortest round trip that is remembered; 0 while nothing is known.
  double round_trip_s() const;

 private:
  struct Seen {
    double at_s, offset_s, round_trip_s;
  };
  double error_s(const Seen& seen, double local_s) const;
  const Seen& best(double local_s) const;
  void estimate_drift();

  std::deque<Seen> exchanges_;  // in order of time
  bool same_ = false;
  double drift_ = 0, drift_error_ = kUnknownDrift;
};

class MasterLink {
 public:
  using Values = std::map<std::string, double>;
  /// An owner that does not tick for longer hangs: it is not said to live any more.
  static constexpr double kLongestWork_s = 60;

  /// Connects to the master at `endpoint`; instance, pid and process_facts() are filled in. Nothing is sent before the
  /// first tick().
  /// give_up_after_s: how long it waits for the master, or for what the session lacks; 0: for ever.
  MasterLink(Context& context, const std::string& endpoint, wire::Hello hello, double give_up_after_s = 0);

  Socket& socket() { return socket_; }
  InstanceId instance() const { return hello_.instance; }

  /// To be called at least every 100 ms: says hello until welcomed (every 250 ms), then reports status (every second)
  /// and asks what the master's clock says; `status` is asked for its values then. Logs what is waited for.
  void tick(double now_s, const std::function<Values()>& status);

  /// Handles welcome, who_are_you, clock_reply and shutdown, rejects other unknown types unless the caller knows them:
  /// returns true if the message was one of these.
  bool handle(const Message& message);

  /// Handles all messages that are here by now; those that handle() does not know are rejected.
  void receive();

  /// What orders of others come to (wire::Order). Without one they are refused.
  using Obey = std::function<void(const wire::Order&)>;
  void on_order(Obey obey) { obey_ = std::move(obey); }
  /// The answer to an order of this master's.
  void answer(uint64_t number, bool ok, std::string text);

  /// Called when this process becomes another instance, because the master knows the one before as another's. Without
  /// it, and after some in a row, the process is refused.
  using Renewed = std::function<void(InstanceId)>;
  void on_renewed(Renewed renewed) { renewed_ = std::move(renewed); }

  /// The newest session, once there is one; version() rises with each.
  const std::optional<wire::Welcome>& session() const { return session_; }
  int version() const { return version_; }
  /// The session is over for this process: its end was told, the master does not let it in, or it waited too long.
  bool shutdown_requested() const { return shutdown_; }
  /// What the master says why the session ends; empty: it has said nothing.
  const std::string& shutdown_reason() const { return shutdown_reason_; }
  /// The master does not take it in (why was logged): bad usage.
  bool refused() const { return refused_; }
  /// What the process ends with, as far as the master goes: 2 if it is refused, 1 if it waited too long, else 0.
  int exit_code() const { return refused_ ? 2 : gave_up_ ? 1 : 0; }
  /// This machine's monotonic time on the master's clock.
  double to_master_s(double local_s) const { return local_s + clock_.offset_s(local_s); }
  const ClockEstimate& clock() const { return clock_; }

  /// Sets a fact that was not known at first; the master is told by another hello.
  void tell(const std::string& fact, const std::string& value);

  /// Last report and goodbye.
  void leave(const std::function<Values()>& status);

 private:
  void report(const std::function<Values()>& status, double now_s);
  void say_hello(double sent_s);
  bool renew();
  void ask_clock(double now_s);
  void look_for_refusal();
  std::string awaited();
  void look_at_waiting(double now_s);
  void learn_clock(const wire::ClockReply& reply, double arrived_s);
  void follow_welcomed(bool welcomed);

  struct Life;
  wire::Hello hello_;
  std::shared_ptr<Life> life_;  // shared with the socket's thread
  Socket socket_;
  std::optional<wire::Welcome> session_;
  int version_ = 0;
  bool shutdown_ = false, welcomed_ = false, refused_ = false, warned_ = false, gave_up_ = false;
  std::string shutdown_reason_;
  Obey obey_;
  Renewed renewed_;
  int hellos_ = 0;         // of this instance, since it was welcomed
  int hellos_before_ = 0;  // of the instance before: they will be refused, too
  int renewals_ = 0;       // since it was welcomed
  ClockEstimate clock_;
  int clock_asked_ = 0;  // since the master is known
  const std::string endpoint_;
  const double give_up_after_s_;
  Waiting waiting_;
  HostSearch host_;
  double ticked_s_ = -1e9, silent_s_ = 0;  // since the master was heard, as far as this process ran
  double last_hello_s_ = -1e9, last_status_s_ = -1e9, last_clock_s_ = -1e9;
};

}  // namespace telesplat::net
