// Says when to repeat a request to a data server: after the time that the link needs, judged by the answers so far.
// Data that is asked for twice comes twice, and makes a slow link slower. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace telesplat::sampler {

class RetryClock {
 public:
  static constexpr double kLeast_s = 2, kMost_s = 60;
  static constexpr double kFirst_s = 15;   ///< patience while nothing has come over the link
  static constexpr double kTimes = 3;      ///< multiple of the time that the link should need
  static constexpr double kWindow_s = 10;  ///< the link's rate is a mean over about this time

  /// About `bytes` bytes are asked for.
  void asked(uint64_t bytes, double now_s) {
    if (open_ == 0) since_s_ = now_s;
    open_ += std::max<uint64_t>(bytes, 1);
  }
  /// `bytes` came in answer to a request for `expected`. Answers at one moment count as one after the other.
  void answered(uint64_t expected, uint64_t bytes, double now_s) {
    const double took_s = std::max(0.0, now_s - since_s_), fades = std::exp(-took_s / kWindow_s);
    bytes_ = bytes_ * fades + double(bytes);
    busy_s_ = busy_s_ * fades + took_s;
    open_ -= std::min(open_, std::max<uint64_t>(expected, 1));
    since_s_ = now_s;
  }
  /// Drops all requests.
  void forget() { open_ = 0; }

  /// True if an answer has come.
  bool known() const { return bytes_ > 0; }
  /// Seconds to wait after the last answer, or after the first open request.
  double patience_s() const {
    if (bytes_ == 0) return kFirst_s;
    return std::clamp(kLeast_s + kTimes * double(open_) * busy_s_ / bytes_, kLeast_s, kMost_s);
  }
  /// True if requests should be repeated. broken: the connection broke after them, so that they may be lost.
  bool overdue(double now_s, bool broken) const {
    return open_ > 0 && now_s - since_s_ > (broken ? kLeast_s : patience_s());
  }

 private:
  uint64_t open_ = 0;  // bytes asked for and not answered
  double since_s_ = 0;
  double bytes_ = 0, busy_s_ = 0;  // sums that decay with kWindow_s
};

}  // namespace telesplat::sampler
