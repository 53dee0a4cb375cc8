// What telesplat-display needs of windows.
#pragma once

#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {

/// Whether windows can be opened here; else why not, naming DISPLAY and WAYLAND_DISPLAY. Opens none.
Status check_display();

/// Displays::window.
Result<std::unique_ptr<DisplaySurface>> open_window(ViewerOptions& options, const DisplayHelp& help);

}  // namespace telesplat::viewer
