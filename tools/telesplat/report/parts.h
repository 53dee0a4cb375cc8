// What was run and how it went, in words and figures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

/// summary.json of a run; null if there is none, or it is no JSON object.
nlohmann::ordered_json read_summary(const std::string& directory);

/// [[what, how], ...]: scene, size, samplers, coupling, version, ... What nobody told is left out.
nlohmann::ordered_json facts_json(const nlohmann::ordered_json& summary);

/// The kinds of figures that a page has, in their order: key, place in summary.json, scale, label, unit, what it means,
/// whether more or less is better, and to which of the page's tables it belongs.
nlohmann::ordered_json figure_kinds();

/// Figures of one run by key: those of the summary; without one, what the tables tell. What is not known is left out.
nlohmann::ordered_json figures_json(const nlohmann::ordered_json& summary, const nlohmann::ordered_json& spreads,
                                    const RunTables& tables);

/// The run's warnings and errors: a list with `process`, `warnings`, `errors` and their first `lines`, for each log.
nlohmann::ordered_json logs_json(const std::string& directory);

/// Series by name (inter_frame_ms, update_age_ms, latency_ms, transfer, psnr_db, ...), each a list with one of each
/// viewer. What there are no rows for is not there.
nlohmann::ordered_json time_series(const RunTables& tables, const PageLimits& limits);

/// Distributions over all viewers, of frames that were drawn: motion_to_photon_ms, inter_frame_ms (first frames left
/// out), construction_ms; and latency_ms, start_up_ms, update_age_ms.
nlohmann::ordered_json spreads(const RunTables& tables);

/// The stages of view updates: of each how long it took in updates over time and in all of them; null without
/// stages.csv.
nlohmann::ordered_json stages_json(const RunTables& tables, const PageLimits& limits);

/// The walk from above: poses with what was measured at them; null without frames.
nlohmann::ordered_json walk_json(const RunTables& tables, const PageLimits& limits);

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// {"shown": [{"frame", "t", "src"}], "compared": [{"name", "frame", "t", "src"}], "of": pictures in images/}:
/// displayed frames, evenly chosen, and what --verify left (reference, display, difference side by side). src: a data
/// URI of a JPEG. bytes: of all of them together; what goes beyond it is left out, and `left_out` counts it. A picture
/// that cannot be read is left out, too.
nlohmann::ordered_json pictures_json(const std::string& directory, const RunTables& tables, const PageLimits& limits,
                                     size_t bytes);

}  // namespace telesplat::launcher
