// The table of flags for a CLI11 command line, until the launcher takes tables.
#include <CLI/CLI.hpp>

#include "common/julia/flags.h"

namespace telesplat::julia {

void add_scene_flags(CLI::App& app, SceneOptions& o) {
  for (const options::Row& row : scene_table(o)) {
    if (const auto* action = std::get_if<options::Action>(&row.value))
      app.add_flag_callback(
             row.flag,
             [act = action->act] {
               act();
               throw CLI::Success();
             },
             row.help)
          ->group(row.group);
    else
      app.add_option(row.flag, *std::get<std::string*>(row.value), row.help)->group(row.group);
  }
}

}  // namespace telesplat::julia
