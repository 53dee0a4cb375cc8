// The packer process (T4.3): gathers tiles, eliminates redundancy, publishes point-model events, serves those who join late.
#pragma once

#include "common/net/service.h"

namespace telesplat::packer {

struct PackerServiceOptions {
  net::ServiceOptions service;
  int threads = 0;           ///< for reference depth maps; 0: all cores
  std::string record_depth;  ///< folder for sampled depth images; empty: none are kept
  int record_depth_frames = 50;
  double log_limit_mb = 512;  ///< events kept for late joiners
};

void add_flags(CLI::App& app, PackerServiceOptions& options);

/// Serves until told to stop. Exit code 0, or 2 if it cannot bind.
int run(const PackerServiceOptions& options);

}  // namespace telesplat::packer
