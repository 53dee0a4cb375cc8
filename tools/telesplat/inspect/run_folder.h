// What `telesplat inspect` tells of a run folder.
#pragma once

#include <string>

#include "common/core/result.h"
#include "services/data/description.h"

namespace telesplat::launcher {

/// Main figures, the scene as it was recorded, files by name with their sizes. Its JSON has all of summary.json. Error:
/// it is no folder of a finished run.
Result<data::Description> inspect_run(const std::string& directory, double skip_s = 0);

}  // namespace telesplat::launcher
