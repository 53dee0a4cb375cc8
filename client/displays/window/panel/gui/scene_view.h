// The parts of the panel that change the scene, as Dear ImGui draws them: a volume's transfer function and series, a
// Julia set's parameters and timeline. They show SceneControls and tell them what the person chose.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "client/displays/window/panel/gui/widgets.h"
#include "client/displays/window/panel/scene_controls.h"

namespace telesplat::viewer {

/// What the editor keeps between frames.
struct TransferViewState {
  int point = 0;        ///< index of the chosen point, if the function has that many
  bool drags = false;   ///< the pointer holds it
  bool linear = false;  ///< heights of the histogram
};

/// Draws bars from the lower side of an area.
void draw_bars(const PlotArea& area, const std::vector<HistogramBar>& bars);

/// Builds it. Between Dear ImGui's frames. save: writes the transfer function to a file of its own choice.
void show_transfer(SceneControls& controls, TransferViewState& state, double now_s, const std::function<void()>& save);

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
