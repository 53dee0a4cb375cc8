// The parts of the panel that change what a mesh is coloured by, what is cut away, and where an isosurface lies. They
// show controls and tell them what the person chose.
#pragma once

#include <optional>
#include <string>

#include "client/displays/window/panel/scene_controls.h"

namespace telesplat::viewer {

/// What these parts keep between frames.
struct ColourViewState {
  std::optional<double> iso;  ///< while it is dragged or typed
  std::string order;          ///< of a clip, as it is typed
  std::string typed_for;      ///< the order in force when that began
  std::string complaint;      ///< about what was typed
};

void show_colours(ColourControls& colours, double now_s);
void show_cut(CutControls& cut, ColourViewState& state, double now_s);
void show_isosurface(ColourControls& colours, ColourViewState& state);

}  // namespace telesplat::viewer
