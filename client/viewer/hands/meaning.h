// What a pick means in the data's own terms: coordinates, values, distances and angles. As JSON for programs, as lines
// for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/viewer/hands/pick.h"
#include "common/scene/colouring.h"
#include "common/scene/placement.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// What of a session is needed to say so.
struct SceneTerms {
  bool placed = false;  ///< the data server told where the data stand; else room metres are all there is
  scene::Placement placement;
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

/// One picked place, in the data's own coordinates where it is known how they stand in the room.
struct PickedPlace {
  glm::dvec3 room{0.0}, data{0.0};
  Pick pick;
  std::optional<ValueRange> value;
};
PickedPlace meaning_of(const Pick& pick, const SceneTerms& terms);

/// {"room", "data", "unit", "normal", "colour", "depth_m", "error_m"; where there is one "array", "value",
/// "value_error", "array_unit"}.
nlohmann::ordered_json to_json(const PickedPlace& place, const SceneTerms& terms);

/// Between picks, in the data's units. Of two: their distance; of three: also the angle at the second one.
struct Measured {
  std::vector<double> distances;  ///< from each to the next, in units of the data
  std::optional<double> angle_deg;
  std::string unit;
};
Measured measure(std::span<const PickedPlace> places, const SceneTerms& terms);

/// "12.5 mm", with as many digits as make sense; without a unit the number alone.
std::string length_text(double length, const std::string& unit);

}  // namespace telesplat::viewer
