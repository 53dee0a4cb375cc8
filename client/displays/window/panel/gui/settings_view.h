// The parts of the panel for settings of the window and of the session's processes.
#pragma once

#include <optional>
#include <string>

#include "client/displays/window/panel/panel.h"

namespace telesplat::viewer {

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

}  // namespace telesplat::viewer
