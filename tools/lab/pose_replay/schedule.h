// Decides when each pose of a recorded movement is sent: at its own time, late by the jitter, or not at all.
#pragma once

#include <optional>
#include <random>
#include <vector>

#include "common/geometry/trajectory.h"

namespace telesplat::lab {

struct Disturbance {
  double jitter_s = 0;  ///< each pose is late by 0 to this, evenly distributed
  double loss = 0;      ///< share of the poses that is left out
  uint64_t seed = 1;
};

/// Uses no clock: times are seconds since the beginning.
class Schedule {
 public:
  /// Precondition: at least one sample, and times strictly increase. loop: begins again after the last sample, one mean
  /// distance between samples later.
  Schedule(std::vector<geometry::Trajectory::Sample> samples, bool loop, const Disturbance& disturbance);

  struct Due {
    double send_s;  ///< not before the pose before it
    double t_s;     ///< the pose's own time
    geometry::Pose pose;
  };
  /// Returns the next pose to send; nothing: all poses are sent.
  std::optional<Due> next();
  uint64_t lost() const { return lost_; }
  /// Time from the first pose to the last; 0 for a loop, which has no end.
  double length_s() const;

 private:
  std::vector<geometry::Trajectory::Sample> samples_;
  bool loop_;
  Disturbance disturbance_;
  std::mt19937_64 random_;
  size_t at_ = 0;
  double round_s_ = 0, send_s_ = 0;  // begin of this round; time of the last pose sent
  uint64_t lost_ = 0;
};

}  // namespace telesplat::lab
