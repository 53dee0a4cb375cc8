// What a sampler can be told on its command line.
#pragma once

#include "common/net/service.h"

namespace telesplat::sampler {

struct SamplerOptions {
  net::ServiceOptions service{.name = net::unique_name("sampler")};
  std::string kind = "auto";     ///< of meshes: "ray", "raster" or "auto" (raster on a hardware GPU, else ray)
  int threads = 0;               ///< 0: all cores
  double chunk_cache_mb = 8192;  ///< of chunks or voxels held, unless one view needs more
  std::string replay;            ///< file of rows sampled before (tiles/replay.h); empty: samples itself
  double cost_scale = 1;         ///< a replayed lease takes this times what its rows took
};

/// A row a flag; they point into `options`.
options::Table table(SamplerOptions& options);

}  // namespace telesplat::sampler
