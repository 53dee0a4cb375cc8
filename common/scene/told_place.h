// A place of a data set that somebody pointed at, as it is told: coordinates, value, what lies between places. As JSON
// for programs, as lines for people.
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
  glm::dvec3 normal_data{0.0};  ///< of unit length; zero: there is none
  std::optional<double> error;  ///< the true place is within so much, in Placement::unit; nothing: there is no bound
  std::string estimate;         ///< why the place was not found in the data; empty: it was
  std::string array, array_unit;
  std::optional<double> value;        ///< nothing: there is none
  std::optional<double> value_error;  ///< its bound; nothing: there is none
  bool operator==(const ToldPlace&) const = default;
};

/// Takes over what was found in the data.
void refine(ToldPlace& place, const Probed& probed, const Placement& placement);

/// {"place": place_text(), "room", "data", "unit", "normal", "error", "estimate", "array", "array_unit", "value",
/// "value_error"}, without what there is not.
nlohmann::ordered_json to_json(const ToldPlace& place, const Placement& placement);
/// Nothing: it has no three numbers "room".
std::optional<ToldPlace> told_place_from(const nlohmann::ordered_json& json, const Placement& placement);

/// "temperature 21.50 +- 0.02 K"; without a bound "temperature about 21.5 K"; empty: there is no value.
std::string value_text(const ToldPlace& place);
/// "12.5 mm", with six digits; without a unit the number alone.
std::string length_text(double length, const std::string& unit);

/// Between places, in lengths of the data. From each to the next; of three or more, the angles at those in between.
struct Measured {
  std::vector<double> distances;
  std::vector<double> angles_deg;  ///< NaN: two of the places are one
};
Measured measure(std::span<const ToldPlace> places, const Placement& placement);

}  // namespace telesplat::scene
