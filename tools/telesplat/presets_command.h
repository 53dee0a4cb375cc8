// `telesplat presets`: the Julia sets and the transfer functions that have names; as text, or the Julia sets as a sheet of pictures.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct PresetsOptions {
  std::string out;  ///< PNG; empty: text on stdout
  std::string size = "480x360";
  int columns = 4;
  int magnify = 2;  ///< rays a pixel on each axis
};

void add_presets_flags(CLI::App& app, PresetsOptions& options);

/// Exit code: 0 done, 1 interrupted or not written, 2 bad usage.
int presets(const PresetsOptions& options);

}  // namespace telesplat::launcher
