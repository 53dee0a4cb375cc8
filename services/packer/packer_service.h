// The packer process (T4.3): takes what samplers send and gives viewers what they do not have yet.
#pragma once

#include "services/packer/packer_options.h"

namespace telesplat::packer {

/// Serves until told to stop. Exit code 0, or 2 if it cannot bind.
Result<int> run(const PackerOptions& options);

}  // namespace telesplat::packer
