// A scene that exists only as mathematics: the session is told what it is, there is nothing to ask for.
#pragma once

#include <memory>

#include "common/julia/flags.h"
#include "services/data/base/progress.h"
#include "services/data/served.h"

namespace telesplat::data {

/// Reads the scene's parameters and finds its box over the whole animation; tells progress if that takes more than two
/// seconds. Error: a parameter is wrong, or the slice is empty at some time.
Result<std::unique_ptr<Served>> serve_julia(const julia::SceneOptions& options, double room_size_m,
                                            const Progress& progress);

}  // namespace telesplat::data
