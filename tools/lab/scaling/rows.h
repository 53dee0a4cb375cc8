// The rows of one frame of a Julia set, each sampled and timed for itself: what the scaling study replays.
#pragma once

#include <functional>

#include "common/geometry/camera.h"
#include "common/julia/flags.h"
#include "services/sampler/tiles/replay_file.h"

namespace telesplat::lab {

/// Samples and encodes each row of `camera`'s frame `passes` times on one thread, as a sampler does a lease of one row;
/// a row's cost is the median. Error: the scene's slice is empty. progress(rows done, of); true from `stop` ends it
/// early, with an error.
Result<sampler::Replay> measure_rows(const julia::Scene& scene, double room_size_m, const geometry::Camera& camera,
                                     int passes, const std::function<void(int, int)>& progress,
                                     const std::function<bool()>& stop);

}  // namespace telesplat::lab
