// Functions of windows that telesplat-display calls.
#pragma once

#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {

/// Checks if windows can be opened here, without opening one. Error: why not; names DISPLAY and WAYLAND_DISPLAY.
Status check_display();

/// Displays::window.
Result<std::unique_ptr<DisplaySurface>> open_window(ViewerOptions& options, const DisplayHelp& help);

}  // namespace telesplat::viewer
