// Whether `telesplat run` would take these words, asked before anything is started.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// arguments: the words behind `telesplat run`. Looks at flags, values and the scene as the command itself does, and
/// starts nothing. Returns how long the run will last, in seconds; 0: not known, it ends after a number of frames.
/// Error: what `telesplat run` would refuse; that the run would not end; that --out, --overwrite, --master or --movie
/// is given, which are the sweep's business or would not be of one run.
Result<double> check_run(const std::vector<std::string>& arguments);

}  // namespace telesplat::launcher
