// Figures of runs without their beginning, in which caches are empty and processes warm up.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Returns summary.json of a run folder with figures from skip_s seconds after its first displayed frame on, and the
/// key "skipped_s". Figures that processes report (memory, errors, points cached) cover the whole run. skip_s 0: as it
/// is. Error: there is no summary, or no frame is that late.
Result<nlohmann::ordered_json> summary_without_beginning(const std::string& directory, double skip_s);

}  // namespace telesplat::launcher
