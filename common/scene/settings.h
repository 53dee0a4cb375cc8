// The settings that users can change while a session runs: one row a setting. `telesplat ctl`, the panel of a window,
// their helps and the table of docs/window.md are made from these rows or compared with them.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/scene/kind.h"

namespace telesplat::scene {

/// Process that carries a change out.
enum class Keeper {
  kSession,   ///< the master, for the whole session
  kViewer,    ///< one viewer, or all that are connected
  kLauncher,  ///< `telesplat run` or `view` that started the session: it starts and ends processes
  kNotes      ///< the process that asks, in the file beside the data set
};

struct Setting {
  std::string_view name;     ///< unique; the name in the panel
  std::string_view section;  ///< section of the panel
  std::string_view order;    ///< the order of `telesplat ctl` that changes it, and the command on the wire
  std::string_view flag;     ///< flag for its first value; empty: it has none
  Kinds kinds;
  Keeper keeper;
  std::string_view what;  ///< one sentence, without a full stop
  /// Widget in the panel that changes it, if not called `name`: a widget of `section`, or with "/" its whole name.
  std::string_view widget = {};
};

/// Sections of the panel and their rows, from the top.
std::span<const Setting> settings();
/// Finds a setting by its name. Null: no such name.
const Setting* find_setting(std::string_view name);
/// Finds the first setting of an order of `telesplat ctl`. Null: the order has none.
const Setting* setting_of_order(std::string_view order);
/// Help text of an order: the sentence of its setting, or of several "name: sentence; name: sentence".
std::string help_of_order(std::string_view order);
/// "mesh, volume"; "all".
std::string text_of(Kinds kinds);
/// The table of docs/window.md, a line a row.
std::string settings_page();

}  // namespace telesplat::scene
