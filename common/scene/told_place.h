// A place of a data set that a user pointed at: coordinates, value, and the distances between such places. As JSON for
// programs, as lines for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/scene/placement.h"
#include "common/scene/probe.h"

namespace telesplat::scene {

struct ToldPlace {
  glm::dvec3 room{0.0}, data{0.0};
  glm::dvec3 normal_data{0.0};  ///< unit length; zero: unknown
  std::optional<double> error;  ///< bound of the distance to the true place, in Placement::unit; nothing: no bound
  std::string estimate;         ///< reason why the data did not give the place; empty: they did
  std::string array, array_unit;
  std::optional<double> value;        ///< nothing: the place has no value
  std::optional<double> value_error;  ///< its bound; nothing: no bound
  bool operator==(const ToldPlace&) const = default;
};

/// Takes over the place and value that a data server found.
void refine(ToldPlace& place, const Probed& probed, const Placement& placement);

/// Writes {"place": place_text(), "room", "data", "unit", "normal", "error", "estimate", "array", "array_unit",
/// "value", "value_error"}, without missing values.
nlohmann::ordered_json to_json(const ToldPlace& place, const Placement& placement);
/// Nothing: "room" is not three numbers.
std::optional<ToldPlace> told_place_from(const nlohmann::ordered_json& json, const Placement& placement);

/// "temperature 21.50 +- 0.02 K"; without a bound "temperature about 21.5 K"; empty: the place has no value.
std::string value_text(const ToldPlace& place);
/// "12.5 mm", with six digits; without a unit only the number.
std::string length_text(double length, const std::string& unit);

/// Distances from each place to the next, in lengths of the data; with three or more, the angles at the inner ones.
struct Measured {
  std::vector<double> distances;
  std::vector<double> angles_deg;  ///< NaN: two neighbouring places coincide
};
Measured measure(std::span<const ToldPlace> places, const Placement& placement);

}  // namespace telesplat::scene
