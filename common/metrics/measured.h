// What a run has measured so far, in memory: what its summary is made from. It is bounded, however long the run lasts.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/metrics/sums/quantiles.h"
#include "common/metrics/sums/tile_sums.h"
#include "common/wire/session_messages.h"

namespace telesplat::metrics {

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

}  // namespace telesplat::metrics
