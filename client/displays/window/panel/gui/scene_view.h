// The parts of the panel that change the scene, as Dear ImGui draws them: a volume's transfer function and series, a
// Julia set's parameters and timeline. They show SceneControls and tell them what the person chose.
#pragma once

#include <functional>
#include <string>

#include "client/displays/window/panel/gui/colour_view.h"
#include "client/displays/window/panel/gui/transfer_view.h"
#include "client/displays/window/panel/scene_controls.h"

namespace telesplat::viewer {

/// What the parts keep between frames.
struct SceneViewState {
  ColourViewState colours;
  TransferViewState transfer;
  int parameter = 0;  ///< index into parameter_infos(), of new key frames
  double key_s = 5;   ///< where they go
};

/// Builds them. Between Dear ImGui's frames. save: writes the transfer function to a file of its own choice.
void show_scene(SceneControls& controls, SceneViewState& state, double now_s, const std::function<void()>& save);

}  // namespace telesplat::viewer
