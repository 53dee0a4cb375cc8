// The dialog that opens a data set, as Dear ImGui draws it.
#pragma once

#include <functional>
#include <string>

#include "client/displays/window/panel/file_list.h"

namespace telesplat::viewer {

/// What the dialog keeps between frames.
struct OpenViewState {
  bool shown = false;
  bool begun = false;  ///< a folder was asked for
  FileList files;
  std::string path;  ///< as it is typed
};

/// Builds it, if it is shown. Between Dear ImGui's frames. open: the person chose this data set. can_close: there is
/// something else to look at.
void show_open(OpenViewState& state, bool can_close, const std::function<void(const std::string&)>& open);

}  // namespace telesplat::viewer
