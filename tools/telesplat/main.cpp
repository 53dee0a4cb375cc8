// telesplat: the launcher. `run` starts a whole pipeline on this machine and records it, `view` shows it in a window.
#include "common/net/service.h"
#include "services/data/base/cut_off.h"
#include "tools/telesplat/command.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main([&] {
    data::end_at_cut_off_files(2);
    const std::string about = "telesplat: explore data sets that are too large for this machine";
    const auto commands = launcher::with_manuals(
        about,
        {launcher::run_command(), launcher::view_command(), launcher::control_command(), launcher::inspect_command(),
         launcher::build_command(), launcher::compare_command(), launcher::movie_command(), launcher::report_command(),
         launcher::sweep_command(), launcher::cache_command(), launcher::keys_command(), launcher::presets_command(),
         launcher::autostereo_command()});
    return launcher::run_commands("telesplat", about, commands, {argv + 1, argv + argc});
  });
}
