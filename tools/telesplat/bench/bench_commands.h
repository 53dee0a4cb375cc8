// `telesplat bench ...`: its sub-commands. Each prints tables; none leaves a process behind.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::launcher {

Command bench_scaling_command();
Command bench_volume_command();
Command bench_cache_command();
Command bench_codec_command();
Command bench_steering_command();
Command bench_tracking_command();

}  // namespace telesplat::launcher
