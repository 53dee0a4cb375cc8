// What --overwrite must not remove.
#pragma once

#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {

/// Before the record in options.out is removed. Error: a session that runs records into it, or a file that the run is
/// to read is part of it.
Status check_overwrite(const RunOptions& options);

}  // namespace telesplat::launcher
