// What a page shows over time, of one run.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {

/// Series by name (inter_frame_ms, update_age_ms, latency_ms, transfer, psnr_db, ...), each a list with one of each
/// viewer. What there are no rows for is not there.
nlohmann::ordered_json time_series(const RunTables& tables, const PageLimits& limits);

/// Distributions over all viewers, of frames that were drawn: motion_to_photon_ms, inter_frame_ms (first frames left
/// out), construction_ms; and latency_ms, start_up_ms, update_age_ms.
nlohmann::ordered_json spreads(const RunTables& tables);

/// How far off figures may be because the run did not last longer (tools::block_intervals): [low, high] by the figure's
/// key, m2p, delay and latency, each with _median and _p95.
nlohmann::ordered_json intervals_json(const RunTables& tables);

/// The stages of view updates: of each how long it took in updates over time and in all of them; null without
/// stages.csv.
nlohmann::ordered_json stages_json(const RunTables& tables, const PageLimits& limits);

/// The walk from above: poses with what was measured at them; null without frames.
nlohmann::ordered_json walk_json(const RunTables& tables, const PageLimits& limits);

}  // namespace telesplat::launcher
