// The results of a sweep as tables: for programs and for people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/common/inference.h"
#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {

/// sweep.csv: a row a run, also for runs that failed or have not ended. Columns: the run, its flags ("flag.NAME"), then
/// every number of its summary by name; empty if the run lacks it.
std::string to_csv(const SweepRecord& record);

/// Appends a line of comma-separated values.
void add_line(std::string& out, const std::vector<std::string>& cells);

/// A row a configuration: median, and least..most if runs differ, of the main figures that were measured. "!" behind a
/// value: its runs differ too much (noises()).
std::string to_text(const SweepRecord& record);

/// "16.7 (16.6..18.2)"; without the brackets if all values are equal to the last digit shown.
std::string text_of(const Measure& figure, const Spread& spread);

/// A main figure of a configuration.
struct Cell {
  size_t configuration;
  const Measure* figure;
  std::vector<double> runs;
  /// Difference of these runs from the first configuration's, and its p after Holm's correction for all comparisons of
  /// the figure. Nothing: this is the first configuration, or one of the two has fewer than two runs.
  std::optional<tools::Difference> difference;
  double p_holm = 1;
};
/// Figure after figure; figures that no run has are left out.
std::vector<Cell> cells_of(const SweepRecord& record);

/// cells.csv: a row a cell (docs/sweep.md).
std::string cells_csv(const SweepRecord& record);

/// Says what cannot be concluded from so few runs; empty: the runs are enough.
std::string too_few(const Grid& grid);

}  // namespace telesplat::launcher
