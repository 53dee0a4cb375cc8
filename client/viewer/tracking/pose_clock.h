// The clock of a program that tells poses, as seen from here.
#pragma once

#include <optional>

namespace telesplat::tracking {

/// Messages come late, some later than others. The least delay of the last seconds is taken for the way that all of
/// them have; what a message took beyond it is jitter, which its own time does not have.
class PoseClock {
 public:
  /// A message of the time t_s (its sender's clock) arrived at arrived_s (ours). Returns its time on our clock, never
  /// after arrived_s. A sender whose clock was set anew is followed after kWindow_s, at once where it was set forward.
  double local_s(double t_s, double arrived_s);
  void restart() { this_.reset(), before_.reset(); }

  static constexpr double kWindow_s = 2.0;

 private:
  std::optional<double> this_, before_;  // least differences of the window that is being filled, of the one before
  double window_began_s_ = 0;
};

}  // namespace telesplat::tracking
