// The workflow timelines of a page, from trace.json.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/telesplat/report/reading/run_tables.h"
#include "tools/telesplat/report/reading/trace_reader.h"

namespace telesplat::launcher {

/// What a page holds of a trace: lanes, names, windows, and a list for each property of the events. Times are in
/// microseconds since origin_s. share: the most events. begin_s, end_s: what the windows lie between.
nlohmann::ordered_json trace_json(const Trace& trace, double origin_s, double begin_s, double end_s, size_t share,
                                  size_t windows);

/// The same of DIRECTORY/trace.json. Without it an object with `why`.
nlohmann::ordered_json trace_part(const std::string& directory, const RunTables& tables, size_t share, size_t windows);

}  // namespace telesplat::launcher
