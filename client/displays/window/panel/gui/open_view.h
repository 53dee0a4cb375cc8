// The dialog that opens a data set, drawn by Dear ImGui.
#pragma once

#include <functional>
#include <string>

#include "client/displays/window/panel/file_list.h"

namespace telesplat::viewer {

/// The dialog's state between frames.
struct OpenViewState {
  bool shown = false;
  bool begun = false;  ///< a folder was requested
  FileList files;
  std::string path;  ///< as typed
};

/// Builds the dialog, if it is shown, between Dear ImGui's frames. open: takes the data set that the person chose.
/// can_close: there is something else to see.
void show_open(OpenViewState& state, bool can_close, const std::function<void(const std::string&)>& open);

}  // namespace telesplat::viewer
