// Command-line options of the packer.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/net/service.h"

namespace telesplat::packer {

struct PackerOptions {
  net::ServiceOptions service{.name = net::unique_name("packer")};
  std::string advertise_to_viewers;  ///< host for the sockets of viewers; empty: service.advertise
  int threads = 0;                   ///< for reference depth maps; 0: all cores
  std::string record_depth;          ///< folder for sampled depth images; empty: they are not recorded
  double log_limit_mb = 512;         ///< events kept for late joiners
  double answer_window_mb = 8;       ///< log bytes under way to one viewer, at most
};

/// One row per flag; the rows point into `options`.
options::Table table(PackerOptions& options);

// Addresses that the packer's sockets bind to.

/// Returns the address of the n-th socket (from 0) of a process started with --bind `bind`: tcp://HOST:PORT with PORT +
/// n. Free ports (`*`) and other transports stay as they are. Error: a port above 65535.
Result<std::string> bind_of(const std::string& bind, int n);

}  // namespace telesplat::packer
