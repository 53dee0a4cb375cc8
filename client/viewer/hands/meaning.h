// Converts a pick to the data's own terms, as far as the viewer knows them.
#pragma once

#include <optional>
#include <string>

#include "client/viewer/hands/pick.h"
#include "common/scene/colouring.h"
#include "common/scene/told_place.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Facts of a session that this needs.
struct SceneTerms {
  scene::Placement placement;                 ///< missing: metres of the room
  std::string data_file, scene;               ///< the data set's path, or empty; its name
  std::optional<scene::Colouring> colouring;  ///< colouring of a mesh; nothing: its own colours
};
/// Facts that cannot be read count as missing.
SceneTerms terms_of(const wire::Welcome& session);

/// Range of an array's values that a colour stands for: the colour map undone within its range. It is a range because
/// colours have 8 bits a channel, and maps may have the same colour twice.
struct ValueRange {
  double lo, hi;
};
/// Nothing: no colour of the map is near (a missing value is grey).
std::optional<ValueRange> value_of_colour(const scene::Colouring& colouring, uint32_t colour);

/// Describes the place by the viewer's own pick: an estimate, without bounds.
scene::ToldPlace meaning_of(const Pick& pick, const SceneTerms& terms);

/// Makes the question to the data server about that place.
scene::Probe probe_of(const Pick& pick, EpochId epoch, double opacity);

}  // namespace telesplat::viewer
