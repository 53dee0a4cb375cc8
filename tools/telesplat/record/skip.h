// Runs without their beginning, in which caches are empty and processes warm up.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/core/result.h"

namespace telesplat::launcher {

/// summary.json of a run folder with figures of what began skip_s seconds after its first displayed frame and later; it
/// says so with the key "skipped_s". What only processes tell (memory, errors, points cached) is of the whole run.
/// skip_s 0: as it is. Error: there is no summary, or no frame is that late.
Result<nlohmann::ordered_json> summary_without_beginning(const std::string& directory, double skip_s);

}  // namespace telesplat::launcher
