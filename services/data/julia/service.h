// The data server of a scene that exists only as mathematics: it says what the scene is, there are no blocks to serve.
#pragma once

#include "services/data/data_service.h"

namespace telesplat::data {

/// run() for the scene "julia": checks its parameters, finds its box over the whole animation, says hello, answers until told to stop.
/// Exit code: 0, or 2 if the parameters are wrong or the slice is empty (one line on stderr says why).
int run_julia(const DataServiceOptions& options);

}  // namespace telesplat::data
