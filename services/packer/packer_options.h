// What the packer can be told on its command line.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/net/service.h"

namespace telesplat::packer {

struct PackerOptions {
  net::ServiceOptions service{.name = net::unique_name("packer")};
  std::string advertise_to_viewers;  ///< host for the sockets of viewers; empty: service.advertise
  int threads = 0;                   ///< for reference depth maps; 0: all cores
  std::string record_depth;          ///< folder for sampled depth images; empty: none are kept
  double log_limit_mb = 512;         ///< events kept for late joiners
  double answer_window_mb = 8;       ///< of these, under way to a viewer at most
};

/// A row a flag; they point into `options`.
options::Table table(PackerOptions& options);

// Where the sockets of a packer bind.

/// Where the n-th socket (from 0) of a process that was told to bind to `bind` does so: tcp://HOST:PORT with PORT + n.
/// Free ports (`*`) and other transports stay as they are. Error: a port above 65535.
Result<std::string> bind_of(const std::string& bind, int n);

}  // namespace telesplat::packer
