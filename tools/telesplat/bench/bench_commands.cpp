#include "tools/telesplat/bench/bench_commands.h"

namespace telesplat::launcher {

Command bench_command() {
  Command out;
  out.name = "bench";
  out.help = "measure the pipeline";
  out.commands = {bench_scaling_command(),  bench_volume_command(), bench_cache_command(),   bench_codec_command(),
                  bench_steering_command(), bench_tracking_command()};
  return out;
}

}  // namespace telesplat::launcher
