// What `telesplat bench scaling` found, as tables for people and programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"

namespace telesplat::launcher {

/// One number of nodes in one series.
struct ScalingPoint {
  int nodes = 0, frames = 0;
  double time_s = 0;  ///< median, from request to the frame's last patch at the viewer
};

/// One way to pay for rows.
struct ScalingSeries {
  std::string name;  ///< "thesis rows", ...
  bool simulated = false;
  double row_seconds = 0;  ///< what all rows of the frame cost together, on one node
  std::vector<ScalingPoint> points;
  /// T(1) / T(N) and T(1) / (N T(N)); none without a measured T(1).
  std::optional<double> speed_up(const ScalingPoint& p) const;
  std::optional<double> efficiency(const ScalingPoint& p) const;
};

/// A sampler killed in mid-frame.
struct KillResult {
  std::string name;
  int nodes = 0;
  double normal_s = 0, killed_s = 0;
};

/// Frames that were really computed.
struct ComputedResult {
  int samplers = 0, frames = 0;
  double median_s = 0, p95_s = 0;
  std::vector<double> busy_s;  ///< a sampler's, over all frames
  double busy_spread() const;  ///< (most - least) / mean
};

struct ScalingReport {
  int width = 0, height = 0, cores = 0;
  std::string scene;
  std::vector<ScalingSeries> series;
  std::vector<ComputedResult> computed;
  std::vector<KillResult> kills;
};

/// Table 7.2 of the thesis: seconds on so many nodes; none for numbers it does not have.
std::optional<double> thesis_time_s(int nodes);
inline constexpr double kThesisSingle_s = 69.3;

std::string to_text(const ScalingSeries& series, int cores);
std::string to_text(const ComputedResult& result);
std::string to_text(const KillResult& result);

/// Writes scaling.csv and scaling.json.
Status write_report(const ScalingReport& report, const std::string& directory);

/// A sampler's busy seconds over the tiles of requests after this one, by name, from a record's tiles.csv. Error: it
/// cannot be read, or has none.
Result<std::vector<double>> busy_times(const std::string& tiles_csv, RequestId after);

}  // namespace telesplat::launcher
