// How far predictions of a head's pose were off, once it is known where the head was, beside what it would have been
// without prediction.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/geometry/camera.h"

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

class PredictionMeter {
 public:
  /// At made_s, when the newest pose was `now`, the head was expected to be at `expected` at for_s. More than
  /// kMostWaiting that wait for their time: the oldest is dropped.
  void predicted(double made_s, const geometry::Pose& now, double for_s, const geometry::Pose& expected);
  /// Where the head was at t_s; calls in the order of time. Between two calls it moved evenly; where they are more than
  /// kMostGap_s apart, nobody knows how.
  void actual(double t_s, const geometry::Pose& pose);

  /// Means over all predictions whose time has come.
  struct Figures {
    uint64_t count = 0;
    double horizon_s = 0;
    double error_m = 0, error_rad = 0;              ///< of the predictions
    double unpredicted_m = 0, unpredicted_rad = 0;  ///< of the poses that were known when they were made
  };
  Figures figures() const;

  static constexpr size_t kMostWaiting = 256;
  static constexpr double kMostGap_s = 0.2;

 private:
  struct Waiting {
    double made_s, for_s;
    geometry::Pose now, expected;
  };
  std::deque<Waiting> waiting_;
  double last_s_ = 0;
  geometry::Pose last_;
  bool begun_ = false;
  Figures sums_;
};

}  // namespace telesplat::tracking
