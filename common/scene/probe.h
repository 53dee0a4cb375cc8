// Asks where a ray meets the data themselves: the order "probe" to a data server, and its answer.
#pragma once

#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/ids.h"
#include "common/core/result.h"

namespace telesplat::scene {

struct Probe {
  EpochId epoch;                                                ///< epoch of the scene when it was shown
  glm::dvec3 origin_room{0.0}, direction_room{0.0, 0.0, -1.0};  ///< direction: unit length
  double opacity = 0.25;  ///< for volumes: opacity summed up to and including the place; (0, 1]
  bool operator==(const Probe&) const = default;
};
/// Writes "epoch", "origin" and "direction" (three numbers each, with commas), "opacity".
std::map<std::string, std::string> to_arguments(const Probe& probe);
/// Error: names the argument that is missing or not such a number.
Result<Probe> probe_from(const std::map<std::string, std::string>& arguments);

struct Probed {
  glm::dvec3 room{0.0}, normal_room{0.0};  ///< normal: unit length, towards the ray's origin; zero: unknown
  std::optional<double> error_m;           ///< bound of the distance to the true place; nothing: no bound
  std::string array, array_unit;           ///< array that `value` is from; empty: a volume's
  std::optional<double> value, value_error;
  bool operator==(const Probed&) const = default;
};
/// Writes JSON {"room", "normal", "error_m", "array", "array_unit", "value", "value_error"}, without missing values.
std::string to_text(const Probed& probed);
/// Error: another form, numbers that are not finite.
Result<Probed> probed_from_text(std::string_view text);

}  // namespace telesplat::scene
