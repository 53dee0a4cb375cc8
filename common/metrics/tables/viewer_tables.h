// What viewers tell row by row: the columns of frames.csv, updates.csv and stages.csv (docs/metrics.md).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace telesplat::metrics {

/// Names of the columns of "frames", "updates" or "stages", in their order, without the viewer's; empty: no such table.
/// Every viewer tells all of them: rows with others are nobody's.
const std::vector<std::string>& viewer_columns(std::string_view table);

}  // namespace telesplat::metrics
