// The panel on display: built by Dear ImGui, or, while it is hidden, its news and its keys over the picture.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/displays/window/overlay.h"
#include "client/displays/window/panel/gui/panel_view.h"
#include "client/displays/window/panel/gui/scene_view.h"
#include "client/displays/window/panel/widget_log.h"

namespace telesplat::viewer {

/// Used by one thread. The constructor's arguments must live longer.
class PanelGui {
 public:
  PanelGui(Panel& panel, SceneControls& scene, Overlays& overlays)
      : panel_(panel), scene_(scene), overlays_(overlays) {}

  /// Builds the panel, if it is shown, between Dear ImGui's frames. save: writes the transfer function. more: builds
  /// further parts. Returns the width that it covers at the left.
  double build(double now_s, const std::function<void()>& save, const std::function<void()>& more);
  /// Shows news to a person who does not see the panel. scale: pixels a side of a letter's dot.
  void show_news(double now_s, int scale);
  /// Shows these keys, if there are any, as large as the window allows.
  void show_help(const std::vector<std::string>& keys, int width, int height);
  WidgetLog& log() { return log_; }

 private:
  Panel& panel_;
  SceneControls& scene_;
  Overlays& overlays_;
  PanelViewState view_;
  SceneViewState scene_view_;
  WidgetLog log_ = WidgetLog::from_environment();
  int help_scale_ = 0;             // size of the help's letters; 0: it is hidden
  std::vector<std::string> news_;  // shown by an overlay
};

}  // namespace telesplat::viewer
