// The editor of a volume's transfer function, as Dear ImGui draws it. It shows a TransferEditor and tells it what the
// person chose.
#pragma once

#include <functional>

#include "client/displays/window/panel/gui/widgets.h"
#include "client/displays/window/panel/scene_controls.h"

namespace telesplat::viewer {

/// What the editor keeps between frames.
struct TransferViewState {
  int point = 0;        ///< that is chosen, where the function has so many
  bool drags = false;   ///< the pointer holds it
  bool linear = false;  ///< heights of the histogram
};

/// Draws bars from the lower side of an area.
void draw_bars(const PlotArea& area, const std::vector<HistogramBar>& bars);

/// Builds it. Between Dear ImGui's frames. save: writes the transfer function to a file of its own choice.
void show_transfer(SceneControls& controls, TransferViewState& state, double now_s, const std::function<void()>& save);

}  // namespace telesplat::viewer
