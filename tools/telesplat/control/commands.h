// Sub-commands of `telesplat ctl`.
#pragma once

#include <vector>

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

/// The sessions of this user on this machine.
Command list_command();
/// How displays and server wait for each other, while a session runs.
Command coupling_command();
/// pick, measure, bookmark, notes: what people point at, and what they keep about it.
std::vector<Command> hands_commands();
/// One for each order of scene::settings() that a viewer or the launcher keeps, and `settings`, which lists all that
/// can be changed.
std::vector<Command> setting_commands();

}  // namespace telesplat::launcher
