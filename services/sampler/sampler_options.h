// The flags of telesplat-sampler.
#pragma once

#include "common/net/service.h"

namespace telesplat::sampler {

struct SamplerOptions {
  net::ServiceOptions service{.name = net::unique_name("sampler")};
  std::string kind = "auto";     ///< for meshes: "ray", "raster" or "auto" (raster on a hardware GPU, else ray)
  int threads = 0;               ///< 0: all cores
  double chunk_cache_mb = 8192;  ///< memory for chunks or voxels, unless one view needs more
  std::string replay;            ///< file of rows that were sampled before (tiles/replay.h); empty: it samples
  double cost_scale = 1;         ///< a replayed lease takes this many times as long as its rows took
};

/// Rows of all flags; they point into `options`.
options::Table table(SamplerOptions& options);

}  // namespace telesplat::sampler
