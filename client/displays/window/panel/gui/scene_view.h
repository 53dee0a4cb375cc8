// Parts of the panel that change the scene, drawn by Dear ImGui: a volume's transfer function and series, a Julia set's
// parameters and timeline. They show SceneControls and pass the person's choices to them.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "client/displays/window/panel/gui/widgets.h"
#include "client/displays/window/panel/scene_controls.h"

namespace telesplat::viewer {

/// The editor's state between frames.
struct TransferViewState {
  int point = 0;        ///< index of the chosen point, if the function has that many
  bool drags = false;   ///< the pointer drags the point
  bool linear = false;  ///< histogram with linear heights
};

/// Draws bars from the lower side of an area.
void draw_bars(const PlotArea& area, const std::vector<HistogramBar>& bars);

/// Builds the editor, between Dear ImGui's frames. save: writes the transfer function to a file of its own choice.
void show_transfer(SceneControls& controls, TransferViewState& state, double now_s, const std::function<void()>& save);

/// State of these parts between frames.
struct ColourViewState {
  std::optional<double> iso;  ///< while it is dragged or typed
  std::string order;          ///< a clip, as typed
  std::string typed_for;      ///< the order in force when typing began
  std::string complaint;      ///< about the typed text
};

void show_colours(ColourControls& colours, double now_s);
void show_cut(CutControls& cut, ColourViewState& state, double now_s);
void show_isosurface(ColourControls& colours, ColourViewState& state);

/// State of all parts between frames.
struct SceneViewState {
  ColourViewState colours;
  TransferViewState transfer;
  int parameter = 0;  ///< for new key frames: index into parameter_infos()
  double key_s = 5;   ///< time of new key frames
};

/// Builds all parts, between Dear ImGui's frames. save: writes the transfer function to a file of its own choice.
void show_scene(SceneControls& controls, SceneViewState& state, double now_s, const std::function<void()>& save);

}  // namespace telesplat::viewer
