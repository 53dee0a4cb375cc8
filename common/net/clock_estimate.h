// How another machine's clock goes, from exchanges of messages with it (NTP, RFC 5905: on-wire protocol and clock
// filter): the exchange with the shortest round trip tells the offset best, since its two ways can differ least. No
// sockets, no clocks.
#pragma once

#include <deque>

namespace telesplat::net {

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

}  // namespace telesplat::net
