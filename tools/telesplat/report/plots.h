// Plots of runs as PNG files, drawn by Python's matplotlib where it is installed.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/telesplat/movie/piped_process.h"

namespace telesplat::launcher {

/// Draws what a page shows (data: its data) into a folder, which is made. Returns the paths of the pictures. Error:
/// why there are none: Python or matplotlib is missing, the folder cannot be written to, or should_stop said so.
Result<std::vector<std::string>> make_plots(const nlohmann::ordered_json& data, const std::string& folder,
                                            const ShouldStop& should_stop);

}  // namespace telesplat::launcher
