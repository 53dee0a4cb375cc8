// What the runs of each configuration say together: means with their intervals, and tests against the first one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/common/inference.h"
#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {

/// A main figure of a configuration.
struct Cell {
  size_t configuration;
  const Measure* figure;
  std::vector<double> runs;
  /// From the first configuration's runs to these, and its p after Holm, the figure's other comparisons counted.
  /// Nothing: it is the first, or one of the two has fewer than two runs.
  std::optional<tools::Difference> difference;
  double p_holm = 1;
};
/// Figure after figure, those alone that some run has.
std::vector<Cell> cells_of(const SweepRecord& record);

/// cells.csv: a row a cell (docs/sweep.md).
std::string cells_csv(const SweepRecord& record);

/// What the number of runs does not allow to say; empty: it allows all.
std::string too_few(const Grid& grid);

}  // namespace telesplat::launcher
