// What a run has measured so far, in memory: what its summary is made from. It is bounded, however long the run lasts.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/metrics/statistics.h"
#include "common/wire/session_messages.h"
#include "common/wire/tile_messages.h"
#include "services/master/record/plan_row.h"

namespace telesplat::metrics {

/// Distributions of values that go on for hours, in bounded memory.
///   Keeps values as they are while they are few; then how many lie in each of buckets whose bounds grow by 1 %, which
/// gives percentiles to half a percent of their value. Count, sum, greatest value and standard
/// deviation are exact always.
class Quantiles {
 public:
  static constexpr size_t kExact = 8192;  ///< values that are kept as they are

  /// Values that are not finite are left out.
  void add(double value);
  uint64_t count() const { return count_; }
  bool empty() const { return count_ == 0; }
  double sum() const { return sum_; }
  /// All 0 for no values.
  Distribution distribution() const;

 private:
  void put(double value);
  double at(double p) const;

  std::vector<double> exact_;              // empty once there are more
  std::map<int, uint64_t> below_, above_;  // buckets of what is negative and positive, by the logarithm of its size
  uint64_t zeros_ = 0, count_ = 0;
  double sum_ = 0, max_ = 0;
  double mean_ = 0, squares_ = 0;  // of differences from it (Welford 1962)
};

/// null if there are no values: nothing was measured.
nlohmann::ordered_json distribution_json(const Quantiles& values);

/// How long each frame took. Coarse frames are a part of their view only, and extra ones come after it: they would
/// flatter these figures.
struct FrameDurations {
  Quantiles leased_ms, sampling_ms, packing_ms;
};

/// What tiles and plans add up to, for the summary: a session leases thousands of them a second.
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

/// A table that viewers fill: the columns of the first that sent rows, which all have, and how many rows came.
struct Table {
  std::vector<std::string> columns;
  uint64_t rows = 0;
};

/// What one viewer did.
struct ViewerFigures {
  uint64_t frames = 0, updates = 0;
  uint64_t still = 0;            ///< of its frames: nothing was drawn for them
  uint64_t frames_of_views = 0;  ///< frames that showed a view that was complete, or what came later
  double duration_s = 0;
  double still_s = 0;  ///< part of it that ended with these
  Quantiles inter_frame_ms, motion_to_photon_ms, latency_ms;
  uint64_t rows_lost = 0;  ///< of its frames: they were displayed, and their rows never came
  double last_s = -1e300;  ///< of its frames
  double last_frame = -1;  ///< its number; below 0: none
  double last_ms = 0;      ///< delay of the last one; 0: it has none, or is still
  std::string coupling;    ///< of the last one

  double per_second(uint64_t count) const;
  /// Frames that were drawn, in the time that was not spent on still ones; 0: there were fewer than two.
  double fps() const;
};

class Measured {
 public:
  static constexpr size_t kMostViewers = 256;  ///< by name; further ones are "others"

  /// "frames", "updates" or "stages"; null for other names.
  Table* table(const std::string& name);
  /// Refuses, and keeps nothing of, rows whose shape does not fit. Precondition: table(more.table).
  Status add(const std::string& viewer, const wire::MetricRows& more);
  void add_epoch() { ++epochs_; }
  TileSums& tiles() { return tiles_; }
  /// Another master goes on with the record, and counts frames anew.
  void begin_life();

  const Table& frames() const { return frames_; }
  const TileSums& tiles() const { return tiles_; }
  uint64_t epochs() const { return epochs_; }
  /// Each by itself: they need not have begun, nor ended, together.
  const std::map<std::string, ViewerFigures>& viewers() const { return viewers_; }

  // Of all viewers' frames that were drawn.
  Quantiles inter_frame_ms, construction_ms, motion_to_photon_ms;
  /// From one delay to the next of the same viewer: how much they differ, in sum, and how often there were two.
  double jitter_sum_ms = 0;
  uint64_t jitters = 0;
  // Of all their frames.
  Quantiles points_drawn, update_age_ms;
  uint64_t frames_shown = 0, frames_still = 0, frame_rows_lost = 0;
  bool headset = false;  ///< some frame had a lead
  uint64_t frames_late = 0;
  bool refreshed = false;  ///< some frame had a refresh to be in time for
  double refreshes_missed = 0;
  bool coupled = false;  ///< their couplings are known
  uint64_t coupling_changes = 0;
  std::vector<std::pair<std::string, uint64_t>> frames_by_coupling;  ///< in the order in which they came up
  /// Of each of a wall's frames, whoever told of it.
  Quantiles swap_skew_ms() const;

  // Of their view updates, without those of which something was left out.
  Quantiles latency_ms;
  // Of all.
  Quantiles start_up_ms;
  double points_received = 0, extra_points = 0;

  // Of the stages of updates.
  std::map<std::string, Quantiles> stages_ms;
  double stages_latency_ms = 0;  ///< the sum of all
  Quantiles display_ms;

 private:
  struct Row;
  void add_frame(ViewerFigures& viewer, const Row& row);
  void add_lost(ViewerFigures& viewer, const Row& row);
  void add_delay(ViewerFigures& viewer, const Row& row);
  void add_coupling(ViewerFigures& viewer, const Row& row);
  void add_skew(const Row& row);
  void add_update(ViewerFigures& viewer, const Row& row);
  void add_stages(const Row& row);
  void close_skews();
  ViewerFigures& viewer_of(const std::string& name);

  Table frames_, updates_, stages_;
  std::map<std::string, ViewerFigures> viewers_;
  std::map<double, double> open_skews_;  // by the wall's frame: others may tell of these yet
  double closed_skew_ = 0;               // of frames up to this one nobody does
  Quantiles skews_;
  TileSums tiles_;
  uint64_t epochs_ = 0;
};

// What viewers tell row by row: the columns of frames.csv, updates.csv and stages.csv (docs/metrics.md).

/// Names of the columns of "frames", "updates" or "stages", in their order, without the viewer's; empty: no such table.
/// Every viewer tells all of them: rows with others are nobody's.
const std::vector<std::string>& viewer_columns(std::string_view table);

}  // namespace telesplat::metrics
