// What a pick means in the data's own terms, as far as the viewer knows.
#pragma once

#include <optional>
#include <string>

#include "client/viewer/hands/pick.h"
#include "common/scene/colouring.h"
#include "common/scene/told_place.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// What of a session is needed to say so.
struct SceneTerms {
  scene::Placement placement;                 ///< not told: metres of the room
  std::string data_file, scene;               ///< the data set's path, empty: it has none; its name
  std::optional<scene::Colouring> colouring;  ///< what a mesh is coloured by; nothing: by its own colours
};
/// What cannot be read counts as not told.
SceneTerms terms_of(const wire::Welcome& session);

/// The value of an array that a colour stands for: the colour map undone within its range. Colours have 8 bits a
/// channel, and maps may have the same colour twice, so it is a range.
struct ValueRange {
  double lo, hi;
};
/// Nothing: no colour of the map is near (a missing value is grey).
std::optional<ValueRange> value_of_colour(const scene::Colouring& colouring, uint32_t colour);

/// What the viewer's own pick says: an estimate, without bounds.
scene::ToldPlace meaning_of(const Pick& pick, const SceneTerms& terms);

/// The question to the data server what lies there.
scene::Probe probe_of(const Pick& pick, EpochId epoch, double opacity);

}  // namespace telesplat::viewer
