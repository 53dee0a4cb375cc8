// The sampler process (T5.2.2): takes leases, fetches the chunks they need, samples, encodes, pushes.
#pragma once

#include "common/net/service.h"

namespace telesplat::sampler {

struct SamplerServiceOptions {
  net::ServiceOptions service;
  std::string kind = "auto";     ///< "ray", "raster" or "auto" (raster on a hardware GPU, else ray)
  int threads = 0;               ///< 0: all cores
  double chunk_cache_mb = 8192;  ///< bytes of chunks held at most, unless one view needs more
};

void add_flags(CLI::App& app, SamplerServiceOptions& options);
int run(const SamplerServiceOptions& options);

}  // namespace telesplat::sampler
