// One direction of the link, which all connections of a relay share: it delays bytes, and gives senders their turns.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <random>

#include "common/links/link.h"

namespace telesplat::wan_relay {

/// One direction of a simulated link, without bytes, sockets and clocks: takes numbers of bytes and times, returns
/// times. Bytes wait in a queue of limited length, pass the bottleneck at the link's rate one after the other, and are
/// then under way for half a round trip and the jitter. Times of calls never fall.
class Shaper {
 public:
  /// from_s: stalls are counted from then; the first begins one period later. seed: for the jitter.
  Shaper(const links::Link& link, double from_s, uint32_t seed);

  /// Bytes that the queue has room for. Without a rate, as many as a link of 100 Gbit/s would take at once.
  size_t room(double now_s);
  /// Returns when the queue has room again, if it is full.
  double room_at_s() const { return queue_.empty() ? 0 : queue_.front().end_s; }
  /// Takes bytes that arrive at the link. Returns the time at which the last of them leaves it, not before earlier
  /// bytes. Precondition: bytes <= room(now_s). 0 bytes: an end of stream, which keeps its place.
  double pass(double now_s, size_t bytes);
  /// The largest piece to pass as one: the bottleneck takes about a millisecond for it.
  size_t piece() const { return piece_; }
  /// Bytes that wait before the bottleneck or are passing it.
  size_t queued(double now_s);

 private:
  struct Waiting {
    double end_s;  // time when it has passed the bottleneck
    size_t bytes;
  };
  double passed(double from_s, double duration_s) const;
  double end_of_stall(double t_s) const;
  double jitter(double now_s);
  void drop_passed(double now_s);

  links::Link link_;
  double from_s_;
  size_t piece_, capacity_;
  std::deque<Waiting> queue_;
  size_t queued_ = 0;
  double free_s_ = 0, last_out_s_ = 0;  // bottleneck; far end
  std::minstd_rand random_;
  double jitter_from_s_ = -1e18, jitter_before_s_ = 0, jitter_after_s_ = 0;
};

using Context = boost::asio::io_context;
using Timer = boost::asio::steady_timer;

/// A time of the monotonic clock, seconds, for a timer.
Timer::time_point time_point(double monotonic_s);

/// A connection that has bytes for the link.
class Sender {
 public:
  virtual ~Sender() = default;
  /// The link has room: puts one piece on it.
  virtual void send_piece() = 0;
};

class Way {
 public:
  Way(Context& context, const links::Link& link, double from_s, uint32_t seed);

  Shaper& shaper() { return shaper_; }
  /// `sender` has bytes: calls it at once if there is room and no other sender waits, else in its turn.
  void join(const std::shared_ptr<Sender>& sender);
  /// Puts bytes on the link; returns when they come out at its end.
  double pass(double now_s, size_t bytes);

  uint64_t bytes() const { return bytes_; }
  size_t most_queued() const { return most_queued_; }

 private:
  void let_in();

  Shaper shaper_;
  Timer timer_;
  std::deque<std::weak_ptr<Sender>> waiting_;
  bool timing_ = false;
  uint64_t bytes_ = 0;
  size_t most_queued_ = 0;
};

}  // namespace telesplat::wan_relay
