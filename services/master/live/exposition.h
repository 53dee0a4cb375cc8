// A session in the text format that Prometheus reads (docs/metrics.md, "Prometheus").
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/master/live/live_figures.h"

namespace telesplat::master {

/// What the master knows of a process.
struct LiveProcess {
  std::string role, name;
  bool alive = false;
  std::optional<double> leases;  ///< of a sampler, that are out
  std::map<std::string, double> values, rates;
};

/// A moment of the session.
struct LiveSnapshot {
  std::string version, scene, kind;
  double started_at_s = 0;  ///< since 1970
  double epoch = 0, views_completed = 0, views_in_flight = 0, views_waiting = 0, leases_expired = 0, leases_backup = 0,
         views_overtaken = 0, frames_given_up = 0, tiles_released = 0;
  std::vector<LiveProcess> processes;
};

/// Processes that are told of, of each role; those that are here come first.
inline constexpr size_t kMostTold = 256;

/// Every series has # HELP and # TYPE. Names of processes are escaped; what is not UTF-8 in them is replaced.
std::string exposition(const LiveSnapshot& snapshot, const LiveFigures& figures);

/// A label's value between its quotes.
std::string escaped_label(const std::string& text);

}  // namespace telesplat::master
