// The panel as Dear ImGui draws it. It shows a Panel and tells it what the person chose; it decides nothing.
#pragma once

#include <functional>
#include <vector>

#include "client/displays/window/panel/gui/settings_view.h"
#include "client/displays/window/panel/panel.h"

namespace telesplat::viewer {

/// A part of the panel below the general ones: other files add theirs.
using PanelSection = std::function<void(Panel&)>;

/// What the panel keeps between frames that nobody else needs.
struct PanelViewState {
  PictureWish picture;
  SettingsViewState settings;
};

/// Builds the panel. Between Dear ImGui's frames, now_s: monotonic clock. Returns its width: it lies at the left side,
/// and nothing shines through.
double show_panel(Panel& panel, PanelViewState& state, double now_s, const std::vector<PanelSection>& more = {});

/// Builds a list of keys beside the panel.
void show_keys(const std::vector<std::string>& lines);

}  // namespace telesplat::viewer
