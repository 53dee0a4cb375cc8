// Slabs that ShearSplatter splats.
#pragma once

#include "services/sampler/volume/slab.h"

namespace telesplat::sampler {

/// They share one splatter with `threads` threads (0: one a core); one of them is splatted at a time.
MakeSlab make_shear_slabs(int threads);

}  // namespace telesplat::sampler
