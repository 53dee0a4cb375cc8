// Where the sockets of a packer bind.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::packer {

/// Where the n-th socket (from 0) of a process that was told to bind to `bind` does so: tcp://HOST:PORT with PORT + n.
/// Free ports (`*`) and other transports stay as they are. Error: a port above 65535.
Result<std::string> bind_of(const std::string& bind, int n);

}  // namespace telesplat::packer
