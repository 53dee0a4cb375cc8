// A session in the text format that Prometheus reads (docs/metrics.md, "Prometheus").
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/wire/session_messages.h"
#include "common/wire/tile_messages.h"

namespace telesplat::master {

// Figures for people who watch: the time that frames and updates take, and the work of each sampler. They follow the
// rows and tiles that the record gets, in bounded memory.

/// Counts values up to each bound.
class Histogram {
 public:
  /// Seconds; the last bucket has no bound.
  static constexpr std::array<double, 18> kBounds{0.002, 0.005, 0.0084, 0.0112, 0.014, 0.0168, 0.025, 0.034, 0.05,
                                                  0.1,   0.15,  0.2,    0.3,    0.5,   1,      2,     5,     10};

  /// NaN and infinities do not count; negative values count as 0.
  void add(double seconds);
  uint64_t count() const { return count_; }
  double sum_s() const { return sum_s_; }
  /// Returns the number of values up to kBounds[bucket].
  uint64_t up_to(size_t bucket) const;

 private:
  std::array<uint64_t, kBounds.size()> counts_{};
  uint64_t count_ = 0;
  double sum_s_ = 0;
};

class LiveFigures {
 public:
  /// Limit for viewers and for samplers. One more replaces the one that left and was measured longest ago; while all
  /// are here, nothing is kept of a new one.
  static constexpr size_t kMostNames = 256;

  struct Named {
    bool here = true;          ///< it takes part; else it left
    uint64_t measured_at = 0;  ///< rises with each value of any name
  };
  struct Viewer : Named {
    Histogram inter_frame, motion_to_photon, update_latency, start_up;
    uint64_t refreshes_missed = 0;
  };
  struct Sampler : Named {
    uint64_t tiles = 0, bytes = 0, rays = 0;
    double busy_s = 0;  ///< sampling and encoding
  };

  /// Notes that the process of this role and name takes part, or has left. Roles other than viewer and sampler change
  /// nothing.
  void set_here(const std::string& role, const std::string& name, bool here);
  /// Adds rows of frames.csv or updates.csv that the record took from a viewer that takes part; ignores other tables.
  void add_rows(const std::string& viewer, const wire::MetricRows& rows);
  /// here: the sampler takes part; tiles of one that has left may come later.
  void add_tile(const std::string& sampler, const wire::TileDone& tile, bool here = true);

  const std::map<std::string, Viewer>& viewers() const { return viewers_; }
  const std::map<std::string, Sampler>& samplers() const { return samplers_; }

 private:
  template <class V>
  V* entry(std::map<std::string, V>& map, const std::string& name, bool here);

  std::map<std::string, Viewer> viewers_;
  std::map<std::string, Sampler> samplers_;
  uint64_t measured_ = 0;
};

/// A process, as the master knows it.
struct LiveProcess {
  std::string role, name;
  bool alive = false;
  std::optional<double> leases;  ///< leases that a sampler holds
  std::map<std::string, double> values, rates;
};

/// A moment of the session.
struct LiveSnapshot {
  std::string version, scene, kind;
  double started_at_s = 0;  ///< seconds since 1970
  double epoch = 0, views_completed = 0, views_in_flight = 0, views_waiting = 0, leases_expired = 0, leases_backup = 0,
         views_overtaken = 0, frames_given_up = 0, tiles_released = 0;
  std::vector<LiveProcess> processes;
};

/// Processes of each role in the text, at most; those that are here come first.
inline constexpr size_t kMostTold = 256;

/// Returns all series, each with # HELP and # TYPE. Escapes names of processes; replaces what is not UTF-8 in them.
std::string exposition(const LiveSnapshot& snapshot, const LiveFigures& figures);

/// Returns a label's value as it stands between its quotes.
std::string escaped_label(const std::string& text);

}  // namespace telesplat::master
