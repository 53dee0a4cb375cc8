// A window's legend: shows what colours mean, over the frame and in saved pictures.
#pragma once

#include <memory>

#include "client/displays/window/overlay.h"
#include "client/displays/window/panel/gui/legend_view.h"
#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/window.h"
#include "client/viewer/display/display_options.h"
#include "common/image/legend.h"

namespace telesplat::viewer {

/// Used by one thread. The constructor's arguments must live longer.
class WindowLegend {
 public:
  WindowLegend(const Window& window, const DisplayOptions& display, Overlays& overlays)
      : window_(window), display_(display), overlays_(overlays) {}

  void on_legend(const std::shared_ptr<const image::Legend>& legend);
  /// Call it after the display's options have changed.
  void show();
  /// True if Dear ImGui draws it. Else it is an overlay.
  bool built() const;
  /// Builds it between Dear ImGui's frames. Precondition: built(). hidden: as in show_legend().
  void build(ColourControls& colours, double now_s, double hidden);
  void not_built() { part_ = {}; }
  /// Part of the window that Dear ImGui's legend covers.
  const WindowPart& part() const { return part_; }
  /// Draws the legend, if it is shown, into a picture that is saved. wall: the display's tile.
  void draw_into(image::View& picture, const WallTile& wall) const;

 private:
  const Window& window_;
  const DisplayOptions& display_;
  Overlays& overlays_;
  std::shared_ptr<const image::Legend> legend_;
  int width_ = 0, height_ = 0;  // the window's size for which the overlay was made
  LegendViewState view_;
  WindowPart part_;
};

}  // namespace telesplat::viewer
