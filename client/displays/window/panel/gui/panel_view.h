// The panel as Dear ImGui draws it. It shows a Panel and tells it what the person chose; it decides nothing.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/displays/window/panel/panel.h"

namespace telesplat::viewer {

// Rows of the panel for settings of scene::settings(): name and explanation come from there.

/// The row's name, which explains itself while it is pointed at; then what the next item fills. Precondition: there is
/// such a setting.
void setting_row(const char* name);
/// Explains the setting while the item before it is pointed at.
void setting_hint(const char* name);

// ---- settings that this window keeps: each shows Panel::value() and calls Panel::choose() ----
void setting_list(Panel& panel, const char* name, std::span<const std::string> choices);
void setting_slider(Panel& panel, const char* name, double least, double most, const char* format);
/// Without a row of its own: several stand beside each other.
void setting_box(Panel& panel, const char* name);

/// What these parts keep between frames.
struct SettingsViewState {
  std::string room_size, z_scale;  ///< as they are typed
  std::optional<int> samplers;     ///< while it is dragged
};

void show_data(Panel& panel, SettingsViewState& state, std::optional<scene::Kind> kind);
void show_display(Panel& panel);
void show_sampling(Panel& panel);
void show_over_the_picture(Panel& panel);
void show_stereo(Panel& panel);
void show_samplers(Panel& panel, SettingsViewState& state);

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
