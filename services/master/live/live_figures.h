// What the master counts for people who watch: how long frames and updates take, and who sampled how much. It follows
// the rows and tiles that the record gets, in bounded memory.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "common/wire/session_messages.h"
#include "common/wire/tile_messages.h"

namespace telesplat::master {

/// How many values were at most as large as each bound.
class Histogram {
 public:
  /// Seconds; the last bucket has no bound.
  static constexpr std::array<double, 18> kBounds{0.002, 0.005, 0.0084, 0.0112, 0.014, 0.0168, 0.025, 0.034, 0.05,
                                                  0.1,   0.15,  0.2,    0.3,    0.5,   1,      2,     5,     10};

  /// Values that are no number do not count, negative ones count as 0.
  void add(double seconds);
  uint64_t count() const { return count_; }
  double sum_s() const { return sum_s_; }
  /// Of values up to kBounds[bucket].
  uint64_t up_to(size_t bucket) const;

 private:
  std::array<uint64_t, kBounds.size()> counts_{};
  uint64_t count_ = 0;
  double sum_s_ = 0;
};

class LiveFigures {
 public:
  static constexpr size_t kMostNames = 256;  ///< viewers, and samplers; of more nothing is kept

  struct Viewer {
    Histogram inter_frame, update_latency, start_up;
  };
  struct Sampler {
    uint64_t tiles = 0, bytes = 0, rays = 0;
    double busy_s = 0;  ///< sampling and encoding
  };

  /// Rows of frames.csv or updates.csv that the record took; others change nothing.
  void add_rows(const std::string& viewer, const wire::MetricRows& rows);
  void add_tile(const std::string& sampler, const wire::TileDone& tile);

  const std::map<std::string, Viewer>& viewers() const { return viewers_; }
  const std::map<std::string, Sampler>& samplers() const { return samplers_; }

 private:
  std::map<std::string, Viewer> viewers_;
  std::map<std::string, Sampler> samplers_;
};

}  // namespace telesplat::master
