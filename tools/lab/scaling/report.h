// What `telesplat-lab scaling` found, as tables for people and programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::lab {

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

/// Table 7.2 of the thesis: seconds on so many nodes; none for numbers it does not have.
std::optional<double> thesis_time_s(int nodes);
inline constexpr double kThesisSingle_s = 69.3;

std::string to_text(const ScalingSeries& series, int cores);

/// Writes scaling.csv.
Status write_report(const std::vector<ScalingSeries>& all, const std::string& directory);

}  // namespace telesplat::lab
