// How long to wait for what a data server was asked for before it is asked again: as long as the link needs, by what
// came over it so far. What is asked for twice comes twice, and makes a slow link slower. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace telesplat::sampler {

class RetryClock {
 public:
  static constexpr double kLeast_s = 2, kMost_s = 60;
  static constexpr double kFirst_s = 15;   ///< while nothing is known of the link
  static constexpr double kTimes = 3;      ///< what the link should need
  static constexpr double kWindow_s = 10;  ///< that its rate is a mean of, about

  /// About so many bytes are asked for.
  void asked(uint64_t bytes, double now_s) {
    if (open_ == 0) since_s_ = now_s;
    open_ += std::max<uint64_t>(bytes, 1);
  }
  /// `bytes` came, of a request for `expected`. What comes at one moment came one after the other.
  void answered(uint64_t expected, uint64_t bytes, double now_s) {
    const double took_s = std::max(0.0, now_s - since_s_), fades = std::exp(-took_s / kWindow_s);
    bytes_ = bytes_ * fades + double(bytes);
    busy_s_ = busy_s_ * fades + took_s;
    open_ -= std::min(open_, std::max<uint64_t>(expected, 1));
    since_s_ = now_s;
  }
  /// Nothing is waited for any more.
  void forget() { open_ = 0; }

  /// Something has come.
  bool known() const { return bytes_ > 0; }
  /// Since the last answer, or since it was asked.
  double patience_s() const {
    if (bytes_ == 0) return kFirst_s;
    return std::clamp(kLeast_s + kTimes * double(open_) * busy_s_ / bytes_, kLeast_s, kMost_s);
  }
  /// broken: the connection broke since it was asked, so that requests and answers may be lost.
  bool overdue(double now_s, bool broken) const {
    return open_ > 0 && now_s - since_s_ > (broken ? kLeast_s : patience_s());
  }

 private:
  uint64_t open_ = 0;  // asked for and not answered
  double since_s_ = 0;
  double bytes_ = 0, busy_s_ = 0;  // decaying
};

}  // namespace telesplat::sampler
