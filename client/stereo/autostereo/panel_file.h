// Reads autostereo displays from TOML files (docs/stereo.md).
#pragma once

#include <string>

#include "client/stereo/autostereo/panel.h"

namespace telesplat::stereo {

/// Error: names file, line, key and limits. Unknown keys are refused.
Result<Panel> read_panel(const std::string& path);

}  // namespace telesplat::stereo
