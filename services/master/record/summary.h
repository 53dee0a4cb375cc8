// summary.json: a run in figures. docs/metrics.md says how each is computed.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/metrics/process.h"
#include "services/master/record/about.h"
#include "services/master/record/measured.h"

namespace telesplat::metrics {

/// processes: all that took part; counters: the master's ("leases_expired", "tiles_released", ...). Where nothing was
/// measured, and where a figure has no meaning for the scene, it is null.
nlohmann::ordered_json summarise(const Measured& measured, const std::vector<Process>& processes,
                                 const std::map<std::string, double>& counters, const About& about);
/// Puts what `measured` tells in the place of what this summary has of it; what only processes tell stays.
void measure_again(const Measured& measured, nlohmann::ordered_json& summary);

}  // namespace telesplat::metrics
