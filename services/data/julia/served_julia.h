// Serves a scene that exists only as mathematics: the session gets its parameters, and there is no data to request.
#pragma once

#include <memory>

#include "common/julia/flags.h"
#include "services/data/base/progress.h"
#include "services/data/served.h"

namespace telesplat::data {

/// Reads the scene's parameters and finds its box over the whole animation; reports progress if that takes over two
/// seconds. Error: a parameter is wrong, or the slice is empty at some time.
Result<std::unique_ptr<Served>> serve_julia(const julia::SceneOptions& options, double room_size_m,
                                            const Progress& progress);

}  // namespace telesplat::data
