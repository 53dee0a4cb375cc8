// Inside common/volume: transfer functions that fit a message.
#pragma once

#include "common/volume/transfer/function.h"

namespace telesplat::volume {

/// As many of the points as a text of `max_bytes` holds, chosen so that the function changes least; all of them if they
/// fit.
TransferFunction shortened(const TransferFunction& transfer, size_t max_bytes);

}  // namespace telesplat::volume
