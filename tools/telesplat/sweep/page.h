// The report of a sweep: one HTML file that needs nothing else, with a row of small plots for each figure.
#pragma once

#include <string>

#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {

/// Which flag is where in the plots.
struct PlotLayout {
  std::optional<size_t> across;   ///< the axis that goes from left to right in a plot; none: nothing varies
  std::optional<size_t> colours;  ///< the axis whose values have colours
  std::vector<size_t> panels;     ///< axes that make a plot for each of their combinations
  bool numeric = false;           ///< all values of `across` are numbers
};
/// Across goes the flag of numbers with the most values, else the last flag with the most; colours are of the first
/// other one that has no more values than there are colours.
PlotLayout layout_of(const Grid& grid);

/// directory: of the sweep; a run's own report, and its folder, are linked where they are there.
std::string to_html(const SweepRecord& record, const Manifest& manifest, const std::string& directory,
                    double skip_s = 0);

}  // namespace telesplat::launcher
