// `telesplat presets`: the Julia sets and the transfer functions that have names.
#include <fmt/format.h>

#include <cstdio>

#include "common/julia/flags.h"
#include "common/volume/transfer/function.h"
#include "tools/telesplat/command.h"

namespace telesplat::launcher {
namespace {

struct PresetsOptions {};

int presets(PresetsOptions, const options::Given&) {
  std::printf("Julia sets (--preset):\n%s\nTransfer functions of volumes (--tf):\n", julia::describe_presets().c_str());
  for (const auto& preset : volume::transfer_presets())
    std::fputs(fmt::format("  {:<12} {}\n", preset.name, preset.text).c_str(), stdout);
  return 0;
}

}  // namespace

Command presets_command() {
  return make_command<PresetsOptions>(
      "presets", "tell the Julia sets and transfer functions that have names",
      [](PresetsOptions&) { return options::Table{}; }, presets);
}

}  // namespace telesplat::launcher
