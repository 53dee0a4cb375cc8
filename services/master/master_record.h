// What the master writes into a run's folder beside the figures: session.toml.
#pragma once

#include <string>
#include <vector>

#include "common/metrics/about.h"
#include "services/master/master_core.h"
#include "services/master/master_options.h"

namespace telesplat::master {

/// session.toml: what was run, the effective configuration of everyone who took part, and what data server and viewer
/// tell of scene and display (metrics::kRecordFact).
std::string session_text(const MasterServiceOptions& options, const MasterCore& core, const metrics::About& about,
                         const std::vector<metrics::Process>& processes);

}  // namespace telesplat::master
