// What people can change while a session runs: one row a setting. `telesplat ctl`, the panel of a window, their helps
// and the table of docs/window.md are made of these rows or compared with them.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/scene/kind.h"

namespace telesplat::scene {

/// Who carries a change out.
enum class Keeper {
  kSession,   ///< the master, and so it is everybody's
  kViewer,    ///< one viewer, or all that are here
  kLauncher,  ///< `telesplat run` or `view` that started the session: it starts and ends processes
  kNotes      ///< whoever asks, in the file beside the data set
};

struct Setting {
  std::string_view name;     ///< unique; as the panel calls it
  std::string_view section;  ///< of the panel
  std::string_view order;    ///< the order of `telesplat ctl` that changes it, and the command on the wire
  std::string_view flag;     ///< that it begins with; empty: there is none
  Kinds kinds;
  Keeper keeper;
  std::string_view what;  ///< one sentence, without a full stop
  /// What changes it in the panel where that is not called `name`: a widget of `section`, or with "/" its whole name.
  std::string_view widget = {};
};

/// Sections of the panel and their rows, from the top.
std::span<const Setting> settings();
/// Null: there is none of this name.
const Setting* find_setting(std::string_view name);
/// Whether this order of `telesplat ctl` has a setting; the first one of it. Null: none has.
const Setting* setting_of_order(std::string_view order);
/// What an order changes: the sentence of its setting, or of several "name: sentence; name: sentence".
std::string help_of_order(std::string_view order);
/// "mesh, volume"; "all".
std::string text_of(Kinds kinds);
/// The table of docs/window.md, a line a row.
std::string settings_page();

}  // namespace telesplat::scene
