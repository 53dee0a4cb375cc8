// The commands of telesplat-lab. Each prints a table or plays a recording; none leaves a process behind.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::lab {

launcher::Command pose_replay_command();
launcher::Command scaling_command();

}  // namespace telesplat::lab
