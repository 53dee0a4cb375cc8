// The flags of telesplat-pose-replay.
#pragma once

#include <cstdint>
#include <string>

#include "common/options/table.h"

namespace telesplat::pose_replay {

struct Options {
  std::string file;
  std::string bind = "tcp://127.0.0.1:7790";
  double jitter_ms = 0;  ///< each pose is late by 0 to so much, evenly distributed
  double loss = 0;       ///< this share of the poses is never sent
  uint64_t seed = 1;     ///< of both
  bool loop = false;
  bool wait = false;      ///< for somebody who listens
  bool no_times = false;  ///< poses without a time: they count from when they arrive
  bool insecure = false;
  std::string name = "pose-replay", log_level = "info";
};

options::Table table(Options& options);

}  // namespace telesplat::pose_replay
