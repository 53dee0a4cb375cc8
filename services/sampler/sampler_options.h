// The flags of telesplat-sampler.
#pragma once

#include "common/net/service.h"

namespace telesplat::sampler {

struct SamplerOptions {
  net::ServiceOptions service{.name = net::unique_name("sampler")};
  std::string kind = "auto";  ///< for meshes: "ray", "raster" or "auto" (raster on a hardware GPU, else ray)
  int threads = 0;            ///< 0: all cores
  double memory_mb = 0;       ///< for chunks or voxels, unless one view needs more; 0: a quarter of usable_memory_mb()
};

/// Rows of all flags; they point into `options`.
options::Table table(SamplerOptions& options);

}  // namespace telesplat::sampler
