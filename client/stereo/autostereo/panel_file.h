// Autostereo displays as TOML files describe them (docs/stereo.md).
#pragma once

#include <string>

#include "client/stereo/autostereo/panel.h"

namespace telesplat::stereo {

/// Error: names file, line, key and limits. Keys that are not known are refused.
Result<Panel> read_panel(const std::string& path);

}  // namespace telesplat::stereo
