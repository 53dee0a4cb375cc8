// The client side of the master, the same for data, sampler, packer, viewer and ctl: hello until welcomed, a status
// report a second, hello again when the master asks, the master's clock, shutdown. While its owner works and does not
// tick, the thread that reads the socket sends signs of life.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/net/connections/waiting.h"
#include "common/net/socket.h"

namespace telesplat::net {

// Estimates another machine's clock from exchanges of messages with it (NTP, RFC 5905: on-wire protocol and clock
// filter): the exchange with the shortest round trip gives the best offset, since its two ways can differ least. No
// sockets, no clocks.

/// A message to the other machine and its answer. Each time is in seconds of the clock of the machine it happened on.
struct ClockExchange {
  double sent_s = 0, received_s = 0;    ///< the message: here, there
  double replied_s = 0, arrived_s = 0;  ///< the answer: there, here
  double round_trip_s() const { return (arrived_s - sent_s) - (replied_s - received_s); }
  double offset_s() const { return ((received_s - sent_s) + (replied_s - arrived_s)) / 2; }
};

class ClockEstimate {
 public:
  static constexpr double kMemory_s = 300;     ///< older exchanges are forgotten
  static constexpr double kDriftAfter_s = 20;  ///< exchanges must span this time to show the drift
  /// Drift assumed at first, and largest change of a known drift (RFC 5905's PHI): seconds a second.
  static constexpr double kUnknownDrift = 100e-6, kWander = 15e-6;

  /// Adds an exchange. Ignores impossible ones (a negative round trip, times that are not finite).
  void add(const ClockExchange& exchange);
  void clear();
  /// Both machines read the same clock: nothing is estimated any more, until clear().
  void same_clock() { same_ = true; }

  bool known() const { return same_ || !exchanges_.empty(); }
  /// The other clock minus this one, at local_s of this one; 0 while nothing is known.
  double offset_s(double local_s) const;
  /// Largest error of offset_s(): half the round trip that it rests on, plus the drift since. Infinite while nothing is
  /// known.
  double error_s(double local_s) const;
  /// Seconds a second by which the other clock is faster; 0 while unknown.
  double drift() const { return same_ ? 0 : drift_; }
  /// The shortest remembered round trip; 0 while nothing is known.
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

/// When the other clock is asked for. Often at first: the shortest round trip of some is near the shortest there is.
class ClockPolls {
 public:
  static constexpr double kPeriod_s = 1.0, kFirstPeriod_s = 0.05;
  static constexpr int kFirst = 8;

  /// True: it should be asked now, and is taken to be.
  bool ask(double now_s) {
    if (now_s - last_s_ < (asked_ < kFirst ? kFirstPeriod_s : kPeriod_s)) return false;
    last_s_ = now_s;
    ++asked_;
    return true;
  }
  void begin_anew() { asked_ = 0; }

 private:
  int asked_ = 0;
  double last_s_ = -1e9;
};

/// A process becomes another instance when the master says that the one before is another's: kMost times in a row.
class Renewals {
 public:
  static constexpr int kMost = 3;

  void said_hello() { ++hellos_; }
  void welcomed() { hellos_ = renewals_ = 0; }
  enum class Answer {
    kToInstanceBefore,  ///< each hello that was said as the instance before is answered
    kRenew,
    kRefused
  };
  /// A hello was answered so.
  Answer refused() {
    if (hellos_before_ > 0) return --hellos_before_, Answer::kToInstanceBefore;
    if (++renewals_ > kMost) return Answer::kRefused;
    hellos_before_ = std::max(0, std::exchange(hellos_, 0) - 1);
    return Answer::kRenew;
  }

 private:
  int hellos_ = 0;         // hellos of this instance, since the last welcome
  int hellos_before_ = 0;  // hellos of the instance before: they will be refused, too
  int renewals_ = 0;       // renewals since the last welcome
};

/// The end of the session for a process.
struct SessionEnd {
  bool over = false;     ///< its end was told, the master does not let the process in, or it waited too long
  bool refused = false;  ///< the master does not take it in
  bool gave_up = false;  ///< it waited too long
  std::string reason;    ///< as the master says it; empty: it has said nothing
};

class MasterLink {
 public:
  using Values = std::map<std::string, double>;
  /// An owner that does not tick for longer hangs: signs of life end.
  static constexpr double kLongestWork_s = 60;

  /// Connects to the master at `endpoint`; instance, pid and process_facts() are filled in. Nothing is sent before the
  /// first tick(). give_up_after_s: limit of a wait for the master, or for processes that the session lacks; 0: for
  /// ever.
  MasterLink(Context& context, const std::string& endpoint, wire::Hello hello, double give_up_after_s = 0);

  Socket& socket() { return socket_; }
  InstanceId instance() const { return hello_.instance; }

  /// To be called at least every 100 ms: says hello until welcomed (every 250 ms), then reports status (every second;
  /// calls `status` for its values) and asks for the master's clock. Logs what it waits for.
  void tick(double now_s, const std::function<Values()>& status);

  /// Handles welcome, who_are_you, clock_reply and shutdown: returns true if the message was one of these. Other
  /// messages are left to the caller.
  bool handle(const Message& message);

  /// Handles all messages that have come; rejects those that handle() does not know.
  void receive();

  /// Handler of orders from others (wire::Order). Without one they are refused.
  using Obey = std::function<void(const wire::Order&)>;
  void on_order(Obey obey) { obey_ = std::move(obey); }
  /// Sends the answer to an order.
  void answer(uint64_t number, bool ok, std::string text);

  /// Called when this process becomes another instance, because the master knows its instance as another process'.
  /// Without a handler, and after some renewals in a row, the process is refused.
  using Renewed = std::function<void(InstanceId)>;
  void on_renewed(Renewed renewed) { renewed_ = std::move(renewed); }

  /// The newest session, once there is one; version() rises with each.
  const std::optional<wire::Welcome>& session() const { return session_; }
  int version() const { return version_; }
  /// The session is over for this process: a shutdown came, the master does not let it in, or it waited too long.
  bool shutdown_requested() const { return end_.over; }
  /// Reason that the master gave for the session's end; empty: none yet.
  const std::string& shutdown_reason() const { return end_.reason; }
  /// The master does not accept this process (the reason was logged): bad usage.
  bool refused() const { return end_.refused; }
  /// The process' exit code as far as the master goes: 2 if it is refused, 1 if it waited too long, else 0.
  int exit_code() const { return end_.refused ? 2 : end_.gave_up ? 1 : 0; }
  /// Converts this machine's monotonic time to the master's clock.
  double to_master_s(double local_s) const { return local_s + clock_.offset_s(local_s); }
  const ClockEstimate& clock() const { return clock_; }

  /// Sets a fact that was not known at first; sends it to the master in another hello.
  void tell(const std::string& fact, const std::string& value);
  /// Sends a hello with other facts, parameters and box; facts that it lacks stay.
  void tell(const wire::Hello& changed);

  /// Sends the last report and goodbye.
  void leave(const std::function<Values()>& status);

 private:
  void report(const std::function<Values()>& status, double now_s);
  void say_hello(double sent_s);
  bool renew();
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
  SessionEnd end_;
  bool welcomed_ = false;
  bool warned_ = false;  // that the master does not let it in
  Obey obey_;
  Renewed renewed_;
  Renewals renewals_;
  ClockEstimate clock_;
  ClockPolls clock_polls_;
  const std::string endpoint_;
  Waiting waiting_;
  HostSearch host_;
  double ticked_s_ = -1e9, silent_s_ = 0;  // silent_s_: since the last message of the master, while this process ran
  double last_hello_s_ = -1e9, last_status_s_ = -1e9;
};

}  // namespace telesplat::net
