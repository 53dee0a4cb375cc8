// What was run and how it went, in words and figures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

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

}  // namespace telesplat::launcher
