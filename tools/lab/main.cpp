// telesplat-lab: simulates sessions of Telesplat, and plays recorded heads to real ones. It is not installed.
#include "common/net/service.h"
#include "services/data/base/cut_off.h"
#include "tools/lab/commands.h"
#include "tools/lab/simulation/command.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main([&] {
    data::end_at_cut_off_files(2);
    return launcher::run_commands(
        "telesplat-lab", "telesplat-lab: simulates sessions of Telesplat, and plays recorded heads to real ones",
        {lab::pose_replay_command(), simulation::simulate_command()}, {argv + 1, argv + argc});
  });
}
