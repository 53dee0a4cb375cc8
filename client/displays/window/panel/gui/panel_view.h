// The panel, drawn by Dear ImGui. It shows a Panel and passes the person's choices to it; it decides nothing.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/displays/window/panel/panel.h"

namespace telesplat::viewer {

// Rows of the panel for settings of scene::settings(), which has their names and explanations.

/// Begins a row: the setting's name, with its explanation while the pointer is on it; the next item fills the rest.
/// Precondition: there is such a setting.
void setting_row(const char* name);
/// Explains the setting while the pointer is on the item before it.
void setting_hint(const char* name);

// ---- settings that this window keeps: each shows Panel::value() and calls Panel::choose() ----
void setting_list(Panel& panel, const char* name, std::span<const std::string> choices);
void setting_slider(Panel& panel, const char* name, double least, double most, const char* format);
/// Makes no row of its own: several stand beside each other.
void setting_box(Panel& panel, const char* name);

/// State of these parts between frames.
struct SettingsViewState {
  std::string room_size, z_scale;  ///< as typed
  std::optional<int> samplers;     ///< while it is dragged
};

void show_data(Panel& panel, SettingsViewState& state, std::optional<scene::Kind> kind);
void show_display(Panel& panel);
void show_sampling(Panel& panel);
void show_over_the_picture(Panel& panel);
void show_stereo(Panel& panel);
void show_samplers(Panel& panel, SettingsViewState& state);

/// A part of the panel below the general ones; other files add theirs.
using PanelSection = std::function<void(Panel&)>;

/// The panel's own state between frames.
struct PanelViewState {
  PictureWish picture;
  SettingsViewState settings;
};

/// Builds the panel, between Dear ImGui's frames. now_s: monotonic clock. Returns its width; it lies at the left side
/// and is opaque.
double show_panel(Panel& panel, PanelViewState& state, double now_s, const std::vector<PanelSection>& more = {});

/// Builds a list of keys beside the panel.
void show_keys(const std::vector<std::string>& lines);

}  // namespace telesplat::viewer
