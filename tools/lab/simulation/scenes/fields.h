// Scenes of simulated sessions that the real samplers sample: a Julia set and a small volume, served by the real data
// server's parts. They ask no file; nothing of them runs on once a call has returned.
#pragma once

#include <memory>

#include "services/data/served.h"

namespace telesplat::simulation {

/// A Julia set of 12 iterations without occlusion, turn or shadow. A tile of 64 x 48 pixels takes about half a
/// millisecond. `telesplat ctl set` and `animate` change it.
std::unique_ptr<data::Served> serve_julia_set();

/// A ball of 32^3 voxels, in 256 levels that fall from its middle to 0 at its surface; lit. About half of the voxels
/// are shown. series: three steps of 24^3 voxels, each smaller, that play at one step a second. It has slices of
/// `part`, 0 .. parts - 1.
std::unique_ptr<data::Served> serve_ball_volume(bool series = false, int part = 0, int parts = 1);

}  // namespace telesplat::simulation
