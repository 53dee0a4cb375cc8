// summary.json: a run in figures. docs/metrics.md says how each figure is computed.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/metrics/process.h"
#include "services/master/record/about.h"
#include "services/master/record/measured.h"

namespace telesplat::metrics {

/// processes: all that took part; counters: the master's ("leases_expired", "tiles_released", ...). A figure is null if
/// it was not measured, or has no meaning for the scene.
nlohmann::ordered_json summarise(const Measured& measured, const std::vector<Process>& processes,
                                 const std::map<std::string, double>& counters, const About& about);
/// Replaces the figures of a summary that come from `measured`; those that only processes report stay.
void measure_again(const Measured& measured, nlohmann::ordered_json& summary);

}  // namespace telesplat::metrics
