// A window's legend: what colours mean, over the frame and in pictures that are saved.
#pragma once

#include <memory>

#include "client/displays/window/overlay.h"
#include "client/displays/window/panel/gui/legend_view.h"
#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/window.h"
#include "client/viewer/display/display_options.h"
#include "common/image/legend.h"

namespace telesplat::viewer {

/// One thread. What it is made of must live longer.
class WindowLegend {
 public:
  WindowLegend(const Window& window, const DisplayOptions& display, Overlays& overlays)
      : window_(window), display_(display), overlays_(overlays) {}

  void on_legend(const std::shared_ptr<const image::Legend>& legend);
  /// The display's options have changed.
  void show();
  /// Whether Dear ImGui draws it. If not, it is an overlay where one is shown.
  bool built() const;
  /// Between Dear ImGui's frames, if built(). hidden: as show_legend() has it.
  void build(ColourControls& colours, double now_s, double hidden);
  void not_built() { part_ = {}; }
  /// What Dear ImGui's legend covers.
  const WindowPart& part() const { return part_; }
  /// Over a picture that is saved, if it is shown. wall: which tile it is.
  void draw_into(image::View& picture, const WallTile& wall) const;

 private:
  const Window& window_;
  const DisplayOptions& display_;
  Overlays& overlays_;
  std::shared_ptr<const image::Legend> legend_;
  int width_ = 0, height_ = 0;  // of the window that the legend on display suits
  LegendViewState view_;
  WindowPart part_;
};

}  // namespace telesplat::viewer
