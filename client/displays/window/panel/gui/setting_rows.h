// Rows of the panel for settings of scene::settings(): name and explanation come from there.
#pragma once

#include <span>
#include <string>

#include "client/displays/window/panel/panel.h"

namespace telesplat::viewer {

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

}  // namespace telesplat::viewer
