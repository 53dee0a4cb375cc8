// When which pose of a recorded movement is sent: at its own time, late by the jitter, or not at all.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include "common/geometry/trajectory.h"

namespace telesplat::lab {

struct Disturbance {
  double jitter_s = 0;  ///< each pose is late by 0 to so much, evenly distributed
  double loss = 0;      ///< share of the poses that are left out
  uint64_t seed = 1;
};

/// Knows no clock: times are seconds since the beginning.
class Schedule {
 public:
  /// Precondition: at least one sample, times strictly increase. loop: from its end it begins again, one mean distance
  /// of samples later.
  Schedule(std::vector<geometry::Trajectory::Sample> samples, bool loop, const Disturbance& disturbance);

  struct Due {
    double send_s;  ///< not before that of the one before it
    double t_s;     ///< its own time
    geometry::Pose pose;
  };
  /// The next one that is sent; nothing: that was all.
  std::optional<Due> next();
  uint64_t lost() const { return lost_; }
  /// From the first pose to the last; 0: of a loop, which has no end.
  double length_s() const;

 private:
  std::vector<geometry::Trajectory::Sample> samples_;
  bool loop_;
  Disturbance disturbance_;
  std::mt19937_64 random_;
  size_t at_ = 0;
  double round_s_ = 0, send_s_ = 0;  // when this round began; the last one was sent
  uint64_t lost_ = 0;
};

}  // namespace telesplat::lab
