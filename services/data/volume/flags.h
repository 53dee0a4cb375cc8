// The command line of a data server's volume.
#pragma once

#include <optional>
#include <string>

#include "services/data/volume/store.h"

namespace CLI {
class App;
}

namespace telesplat::data {

/// As given: nothing is read or checked yet but --raw's neighbours on the command line.
struct VolumeFlags {
  std::string raw;                       ///< also of isosurfaces
  std::string transfer, lighting, part;  ///< empty: not given
  std::optional<double> series_rate;
  std::optional<int> cache_mb;
  bool any_but_raw() const;  ///< something was given that only a volume takes
};

/// --raw, --tf, --lighting, --series-rate, --part, --volume-cache-mb; --list-tf tells the presets and ends the program.
void add_volume_flags(CLI::App& app, VolumeFlags& flags);

VolumeOptions to_options(const VolumeFlags& flags);

/// Names and descriptions of the transfer functions there are, a line each.
std::string describe_transfer_presets();

}  // namespace telesplat::data
