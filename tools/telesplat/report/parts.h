// The parts of a report page: facts and figures of a run, logs, series, pictures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

/// Reads summary.json of a run; null: the file is missing or holds no JSON object.
nlohmann::ordered_json read_summary(const std::string& directory);

/// [[what, how], ...]: scene, size, samplers, coupling, version, ... Unknown facts are left out.
nlohmann::ordered_json facts_json(const nlohmann::ordered_json& summary);

/// Returns the kinds of figures that a page has, in their order: key, place in summary.json, scale, label, unit,
/// meaning, direction (1 more is better, -1 less, 0 neither), and the page's table that shows it.
nlohmann::ordered_json figure_kinds();

/// Returns one run's figures by key, from the summary; without one, from the tables. Unknown figures are left out.
nlohmann::ordered_json figures_json(const nlohmann::ordered_json& summary, const nlohmann::ordered_json& spreads,
                                    const RunTables& tables);

/// The run's warnings and errors: for each log `process`, `warnings`, `errors` and their first `lines`.
nlohmann::ordered_json logs_json(const std::string& directory);

/// Series by name (inter_frame_ms, update_age_ms, latency_ms, transfer, psnr_db, ...), each a list with one entry a
/// viewer. A series without rows is left out.
nlohmann::ordered_json time_series(const RunTables& tables, const PageLimits& limits);

/// Distributions over the drawn frames of all viewers: motion_to_photon_ms, inter_frame_ms (without first frames),
/// construction_ms; and latency_ms, start_up_ms, update_age_ms.
nlohmann::ordered_json spreads(const RunTables& tables);

/// The stages of view updates: the time of each over the run, and its distribution; null without stages.csv.
nlohmann::ordered_json stages_json(const RunTables& tables, const PageLimits& limits);

/// The walk seen from above: poses with the values measured there; null without frames.
nlohmann::ordered_json walk_json(const RunTables& tables, const PageLimits& limits);

/// Encodes by RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// {"shown": [{"frame", "t", "src"}], "compared": [{"name", "frame", "t", "src"}], "of": pictures in images/}:
/// displayed frames, evenly chosen, and pictures of --verify (reference, display, difference side by side). src: a data
/// URI of a JPEG. bytes: limit for all together; pictures beyond it are left out, and `left_out` counts them. An
/// unreadable picture is left out, too.
nlohmann::ordered_json pictures_json(const std::string& directory, const RunTables& tables, const PageLimits& limits,
                                     size_t bytes);

}  // namespace telesplat::launcher
