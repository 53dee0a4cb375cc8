// `telesplat ctl list`: the sessions of this user on this machine.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

Command list_command();

}  // namespace telesplat::launcher
