// `telesplat ctl` for settings that a viewer or the launcher keeps: a command a setting, made of scene::settings().
#pragma once

#include <vector>

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

/// One for each order, and `settings`, which lists all that can be changed.
std::vector<Command> setting_commands();

}  // namespace telesplat::launcher
