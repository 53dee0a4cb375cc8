// The sampler process (T5.2.2): takes leases, samples what they ask for, encodes, pushes. What sampling is depends on the
// session's kind (lease_work.h).
#pragma once

#include "common/net/service.h"

namespace telesplat::sampler {

struct SamplerServiceOptions {
  net::ServiceOptions service;
  std::string kind = "auto";     ///< for meshes: "ray", "raster" or "auto" (raster on a hardware GPU, else ray)
  int threads = 0;               ///< 0: all cores
  double chunk_cache_mb = 8192;  ///< bytes of chunks held at most, unless one view needs more
  std::string replay;            ///< file of rows sampled before (replay_file.h); empty: samples itself
  int repeat_views = 0;          ///< a view of a volume that was sampled so often is sent again after as long; 0: never
  double cost_scale = 1;         ///< a replayed lease takes this times what its rows took
};

void add_flags(CLI::App& app, SamplerServiceOptions& options);

/// Serves until told to finish. Told by SIGINT or SIGTERM it finishes what it holds, asks for no more, and is gone within 2 s; told by
/// the master it ends at once. Exit code: 0; 1 if the sampler asked for cannot be made; 2 if the replay file cannot be read.
int run(const SamplerServiceOptions& options);

}  // namespace telesplat::sampler
