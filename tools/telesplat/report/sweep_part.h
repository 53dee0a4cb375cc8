// The runs of a sweep, as sweep.csv and cells.csv of its folder tell them.
#pragma once

#include "tools/telesplat/report/report.h"

namespace telesplat::launcher {

bool is_sweep(const std::string& directory);

/// Puts into `options` what a page shows of a sweep, and as runs the first that is done of each configuration, named
/// by the flags that vary. Error: sweep.csv is none, or no run is done.
Status take_sweep(const std::string& directory, ReportOptions& options);

}  // namespace telesplat::launcher
