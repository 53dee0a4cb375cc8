// What tiles and plans add up to, for the summary: a session leases thousands of them a second.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "common/metrics/plans/plan_row.h"
#include "common/metrics/sums/quantiles.h"
#include "common/wire/tile_messages.h"

namespace telesplat::metrics {

/// How long each frame took. Coarse frames are a part of their view only, and extra ones come after it: they would
/// flatter these figures.
struct FrameDurations {
  Quantiles leased_ms, sampling_ms, packing_ms;
};

class TileSums {
 public:
  static constexpr size_t kMostSamplers = 1024;  ///< by name; further ones are "others"

  void add(const std::string& sampler, const wire::TileDone& tile);
  /// Before the tiles of its frame.
  void add(const PlanRow& plan);
  /// Another master counts frames anew: what comes belongs to none of those before.
  void begin_life();

  double samples() const { return samples_; }
  double kept() const { return kept_; }
  double bytes_sent() const { return bytes_sent_; }
  /// Tiles that were published with an error, and the largest of each (wire::TileDone).
  uint64_t bounded() const { return bounded_; }
  double depth_error_m() const { return depth_error_m_; }
  double normal_error_deg() const { return normal_error_deg_; }
  double colour_error() const { return colour_error_; }
  double rays_cast() const { return rays_cast_; }
  double rays_full() const { return rays_full_; }  ///< without plans
  /// Sample begin to encode end, s, by sampler.
  const std::map<std::string, double>& busy_s() const { return busy_s_; }
  FrameDurations durations() const;
  uint64_t plans() const { return plans_; }
  uint64_t plans_late() const { return plans_late_; }
  const Quantiles& plan_ms() const { return plan_ms_; }
  const Quantiles& plan_answer_ms() const { return plan_answer_ms_; }

 private:
  struct Times {
    double leased = 1e300, begin = 1e300, end = 0, packing_s = 0;
  };
  static void close(const Times& frame, FrameDurations& durations);
  void time(const wire::TileDone& tile);

  double samples_ = 0, kept_ = 0, bytes_sent_ = 0, rays_cast_ = 0, rays_full_ = 0;
  uint64_t bounded_ = 0;
  double depth_error_m_ = 0, normal_error_deg_ = 0, colour_error_ = 0;
  std::map<std::string, double> busy_s_;
  std::map<uint64_t, Times> open_;  // frames that may have further tiles
  uint64_t closed_ = 0;             // frames up to this one have none
  FrameDurations durations_;
  std::set<uint64_t> planned_;  // the newest frames that have the rays of a plan
  uint64_t plans_ = 0, plans_late_ = 0;
  Quantiles plan_ms_, plan_answer_ms_;
};

}  // namespace telesplat::metrics
