// `telesplat ctl coupling`: how displays and server wait for each other, while a session runs.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

Command coupling_command();

}  // namespace telesplat::launcher
