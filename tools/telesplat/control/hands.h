// `telesplat ctl pick|measure|bookmark|notes`: what people point at, and what they keep about it.
#pragma once

#include <vector>

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

std::vector<Command> hands_commands();

}  // namespace telesplat::launcher
