// The commands of telesplat-lab.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::lab {

launcher::Command pose_replay_command();

}  // namespace telesplat::lab
