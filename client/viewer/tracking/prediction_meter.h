// Measures the errors of predicted head poses once the true poses are known, beside the errors without prediction.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/geometry/camera.h"

namespace telesplat::tracking {

/// Messages come late, some later than others. The least delay of the last seconds counts as the delay that all have; a
/// message's time beyond it is jitter, and is taken out.
class PoseClock {
 public:
  /// A message of time t_s (its sender's clock) arrived at arrived_s (ours). Returns its time on our clock, never after
  /// arrived_s. If the sender's clock was set back, it is followed after kWindow_s; if it was set forward, at once.
  double local_s(double t_s, double arrived_s);
  void restart() { this_.reset(), before_.reset(); }

  static constexpr double kWindow_s = 2.0;

 private:
  std::optional<double> this_, before_;  // least differences in the present window, and in the one before
  double window_began_s_ = 0;
};

class PredictionMeter {
 public:
  /// At made_s, when the newest pose was `now`, the head was predicted to be at `expected` at for_s. If more than
  /// kMostWaiting predictions wait for their time, the oldest is dropped.
  void predicted(double made_s, const geometry::Pose& now, double for_s, const geometry::Pose& expected);
  /// The head was at `pose` at t_s; calls are in the order of time. Between two calls it is assumed to move evenly; if
  /// they are more than kMostGap_s apart, predictions between them do not count.
  void actual(double t_s, const geometry::Pose& pose);

  /// Means over all predictions whose time has come.
  struct Figures {
    uint64_t count = 0;
    double horizon_s = 0;
    double error_m = 0, error_rad = 0;              ///< errors of the predictions
    double unpredicted_m = 0, unpredicted_rad = 0;  ///< errors of the poses that were known when predictions were made
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
