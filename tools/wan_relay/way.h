// One direction of the link, which all connections of a relay share: who may put bytes on it, in turn.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <deque>
#include <memory>

#include "common/links/shaper.h"

namespace telesplat::wan_relay {

using Context = boost::asio::io_context;
using Timer = boost::asio::steady_timer;

/// A time of the monotonic clock, seconds, for a timer.
Timer::time_point time_point(double monotonic_s);

/// Whoever has bytes for the link.
class Sender {
 public:
  virtual ~Sender() = default;
  /// There is room on the link: puts one piece on it.
  virtual void send_piece() = 0;
};

class Way {
 public:
  Way(Context& context, const links::Link& link, double from_s, uint32_t seed);

  links::Shaper& shaper() { return shaper_; }
  /// `sender` has bytes: it is called at once if there is room and nobody waits for it, else in its turn.
  void join(const std::shared_ptr<Sender>& sender);
  /// Bytes are put on the link; when they come out at its end.
  double pass(double now_s, size_t bytes);

  uint64_t bytes() const { return bytes_; }
  size_t most_queued() const { return most_queued_; }

 private:
  void let_in();

  links::Shaper shaper_;
  Timer timer_;
  std::deque<std::weak_ptr<Sender>> waiting_;
  bool timing_ = false;
  uint64_t bytes_ = 0;
  size_t most_queued_ = 0;
};

}  // namespace telesplat::wan_relay
