// How well heads are predicted, on recorded movements: computed, not timed.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/viewer/tracking/pose_predictor.h"
#include "common/core/result.h"
#include "common/geometry/trajectory.h"

namespace telesplat::launcher {

/// A way of predicting at one horizon, over one recorded movement or several.
struct TrackingFigures {
  double mean_mm = 0, p95_mm = 0, mean_deg = 0, p95_deg = 0;
};

struct TrackingRow {
  std::string file;  ///< its name, or "all"
  int horizon_ms = 0;
  size_t poses = 0;                        ///< that were predicted
  std::vector<TrackingFigures> by_method;  ///< in the order of tracking::kPredictionNames
};

/// For each pose of a movement, but those of its first half second: where each way expects the head to be at each
/// horizon, against where it was then. rate_hz: poses are told so often; 0: as recorded. go_on: asked now and then.
/// The last rows are of all movements, each with the weight of its poses.
struct Movement {
  std::string name;
  std::vector<geometry::Trajectory::Sample> samples;
};
std::vector<TrackingRow> measure_tracking(const std::vector<Movement>& movements, const std::vector<int>& horizons_ms,
                                          double rate_hz, const std::function<bool()>& go_on);

/// A table as Markdown: errors without prediction, and each way's over those.
std::string to_markdown(const std::vector<TrackingRow>& rows);
/// A row a movement, horizon and way.
Status write_csv(const std::vector<TrackingRow>& rows, const std::string& path);

}  // namespace telesplat::launcher
