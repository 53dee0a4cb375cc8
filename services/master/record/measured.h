// Figures that a run has measured so far, in memory, for its summary. They are bounded, however long it lasts.
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
///   Keeps values as they are while they are few; then counts them in buckets whose bounds grow by 1 %, which gives
/// percentiles to half a percent of their value. Count, sum, greatest value and standard deviation are always exact.
class Quantiles {
 public:
  static constexpr size_t kExact = 8192;  ///< values that are kept as they are

  /// Values that are not finite are left out.
  void add(double value);
  uint64_t count() const { return count_; }
  bool empty() const { return count_ == 0; }
  double sum() const { return sum_; }
  /// Without values, all figures are 0.
  Distribution distribution() const;

 private:
  void put(double value);
  double at(double p) const;

  std::vector<double> exact_;              // empty once there are more than kExact
  std::map<int, uint64_t> below_, above_;  // buckets of negative and positive values, by the logarithm of their size
  uint64_t zeros_ = 0, count_ = 0;
  double sum_ = 0, max_ = 0;
  double mean_ = 0, squares_ = 0;  // squares_: of differences from mean_ (Welford 1962)
};

/// Returns the distribution as JSON; null if there are no values.
nlohmann::ordered_json distribution_json(const Quantiles& values);

/// Times that each frame took. Coarse frames, which are only a part of their view, and extra frames, which come after
/// it, do not count: they would flatter these figures.
struct FrameDurations {
  Quantiles leased_ms, sampling_ms, packing_ms;
};

/// Sums over tiles and plans, for the summary: a session leases thousands of tiles a second.
class TileSums {
 public:
  static constexpr size_t kMostSamplers = 1024;  ///< samplers by name; further ones are "others"

  void add(const std::string& sampler, const wire::TileDone& tile);
  /// To be called before the tiles of the plan's frame are added.
  void add(const PlanRow& plan);
  /// Another master counts frames anew: its tiles do not belong to earlier frames of the same number.
  void begin_life();

  double samples() const { return samples_; }
  double kept() const { return kept_; }
  double bytes_sent() const { return bytes_sent_; }
  /// Number of tiles that were published with an error, and the largest error of each kind (wire::TileDone).
  uint64_t bounded() const { return bounded_; }
  double depth_error_m() const { return depth_error_m_; }
  double normal_error_deg() const { return normal_error_deg_; }
  double colour_error() const { return colour_error_; }
  double rays_cast() const { return rays_cast_; }
  double rays_full() const { return rays_full_; }  ///< rays that would be cast without plans
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
  uint64_t closed_ = 0;             // frames up to this number have no further tiles
  FrameDurations durations_;
  std::set<uint64_t> planned_;  // the newest frames that follow a plan
  uint64_t plans_ = 0, plans_late_ = 0;
  Quantiles plan_ms_, plan_answer_ms_;
};

/// A table that viewers fill: the columns of the first viewer that sent rows, which all must have, and the row count.
struct Table {
  std::vector<std::string> columns;
  uint64_t rows = 0;
};

/// Figures of one viewer.
struct ViewerFigures {
  uint64_t frames = 0, updates = 0;
  uint64_t still = 0;            ///< frames for which nothing was drawn
  uint64_t frames_of_views = 0;  ///< frames that showed a complete view, or later points
  double duration_s = 0;
  double still_s = 0;  ///< part of duration_s that ended with still frames
  Quantiles inter_frame_ms, motion_to_photon_ms, latency_ms;
  uint64_t rows_lost = 0;  ///< frames that were displayed, and whose rows never came
  double last_s = -1e300;  ///< time of its last frame
  double last_frame = -1;  ///< number of its last frame; below 0: no frame
  double last_ms = 0;      ///< delay of its last frame; 0: it has no delay, or is still
  std::string coupling;    ///< coupling of its last frame

  double per_second(uint64_t count) const;
  /// Drawn frames a second, without the time of still ones; 0: fewer than two were drawn.
  double fps() const;
};

struct MeasuredRow;

/// Sums over the frames of all viewers.
struct FrameSums {
  void add(ViewerFigures& viewer, const MeasuredRow& row);

  // Drawn frames.
  Quantiles inter_frame_ms, construction_ms, motion_to_photon_ms;
  /// Sum of the differences between successive delays of the same viewer, and their number.
  double jitter_sum_ms = 0;
  uint64_t jitters = 0;
  // All frames.
  Quantiles points_drawn, update_age_ms;
  uint64_t shown = 0, still = 0, rows_lost = 0;
  bool headset = false;  ///< true if a frame had a lead
  uint64_t late = 0;
  bool refreshed = false;  ///< true if a frame had a refresh to be in time for
  double refreshes_missed = 0;

 private:
  void add_lost(ViewerFigures& viewer, const MeasuredRow& row);
  void add_delay(ViewerFigures& viewer, const MeasuredRow& row);
};

/// Returns the frames under each coupling, and how often viewers went from one to another.
struct Couplings {
  void add(ViewerFigures& viewer, const MeasuredRow& row);

  bool known = false;
  uint64_t changes = 0;
  std::vector<std::pair<std::string, uint64_t>> frames;  ///< in the order in which they came up
};

/// Skew of each of a wall's frames once, though several viewers report it.
class WallSkews {
 public:
  void add(const MeasuredRow& row);
  /// Frames are counted anew.
  void close();
  Quantiles ms() const;

 private:
  std::map<double, double> open_;  // by the wall's frame: other viewers may still report these
  double closed_ = 0;              // frames up to this one are not reported any more
  Quantiles skews_;
};

/// Sums over the view updates of all viewers.
struct UpdateSums {
  void add(ViewerFigures& viewer, const MeasuredRow& row);

  Quantiles latency_ms;  ///< except updates from which something was left out
  Quantiles start_up_ms;
  double points_received = 0, extra_points = 0;
};

/// Where the time of view updates went.
struct StageSums {
  void add(const MeasuredRow& row);

  std::map<std::string, Quantiles> ms;
  double latency_ms = 0;  ///< sum over all updates
  Quantiles display_ms;
};

class Measured {
 public:
  static constexpr size_t kMostViewers = 256;  ///< viewers by name; further ones are "others"

  /// "frames", "updates" or "stages"; null for other names.
  Table* table(const std::string& name);
  /// Adds rows. Error: their shape does not fit; then all of them are dropped. Precondition: table(more.table).
  Status add(const std::string& viewer, const wire::MetricRows& more);
  void add_epoch() { ++epochs_; }
  TileSums& tiles() { return tiles_; }
  /// Another master goes on with the record, and counts frames anew.
  void begin_life();

  const Table& frames() const { return frames_; }
  const TileSums& tiles() const { return tiles_; }
  uint64_t epochs() const { return epochs_; }
  /// Figures of each viewer by itself: viewers need not begin or end together.
  const std::map<std::string, ViewerFigures>& viewers() const { return viewers_; }

  // Figures of all viewers together.
  FrameSums frame_sums;
  Couplings couplings;
  WallSkews wall_skews;
  UpdateSums update_sums;
  StageSums stage_sums;

 private:
  ViewerFigures& viewer_of(const std::string& name);

  Table frames_, updates_, stages_;
  std::map<std::string, ViewerFigures> viewers_;
  TileSums tiles_;
  uint64_t epochs_ = 0;
};

// Columns of the rows that viewers send, for frames.csv, updates.csv and stages.csv (docs/metrics.md).

/// Names of the columns of "frames", "updates" or "stages", in their order, without the viewer's; empty: no such table.
/// Every viewer sends all of them: rows with other columns are not a viewer's.
const std::vector<std::string>& viewer_columns(std::string_view table);

}  // namespace telesplat::metrics
