// What a sweep found, as tables: for programs and for people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/common/inference.h"
#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {

/// sweep.csv: a row a run, those that failed or have not ended included. Columns: the run, its flags ("flag.NAME"),
/// then every number of its summary by name; empty where a run has none.
std::string to_csv(const SweepRecord& record);

/// Appends a line of comma-separated values.
void add_line(std::string& out, const std::vector<std::string>& cells);

/// A row a configuration: median, and least..most where runs differ, of the main figures that were measured. "!" behind
/// a value: its runs differ too much (noises()).
std::string to_text(const SweepRecord& record);

/// "16.7 (16.6..18.2)"; without the brackets where all are the same to the last digit that is shown.
std::string text_of(const Measure& figure, const Spread& spread);

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
