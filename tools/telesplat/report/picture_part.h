// Pictures of a run for its page: few, small, in the page itself.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// {"shown": [{"frame", "t", "src"}], "compared": [{"name", "frame", "t", "src"}], "of": pictures in images/}:
/// displayed frames, evenly chosen, and what --verify left (reference, display, difference side by side). src: a data
/// URI of a JPEG. bytes: of all of them together; what goes beyond it is left out, and `left_out` counts it. A picture
/// that cannot be read is left out, too.
nlohmann::ordered_json pictures_json(const std::string& directory, const RunTables& tables, const PageLimits& limits,
                                     size_t bytes);

}  // namespace telesplat::launcher
