// The question what a ray meets in the data themselves: the order "probe" to a data server, and its answer.
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
  EpochId epoch;                                                ///< the scene as it was shown then
  glm::dvec3 origin_room{0.0}, direction_room{0.0, 0.0, -1.0};  ///< of unit length
  double opacity = 0.25;  ///< of volumes: how much is hidden by what lies before the place and at it; (0, 1]
  bool operator==(const Probe&) const = default;
};
/// "epoch", "origin" and "direction" (three numbers each, with commas), "opacity".
std::map<std::string, std::string> to_arguments(const Probe& probe);
/// Error: what is missing or no such number.
Result<Probe> probe_from(const std::map<std::string, std::string>& arguments);

struct Probed {
  glm::dvec3 room{0.0}, normal_room{0.0};  ///< normal: of unit length, towards the ray's origin; zero: there is none
  std::optional<double> error_m;           ///< the place is within so much of this one; nothing: there is no bound
  std::string array, array_unit;           ///< whose value it is; empty: a volume's
  std::optional<double> value, value_error;
  bool operator==(const Probed&) const = default;
};
/// JSON {"room", "normal", "error_m", "array", "array_unit", "value", "value_error"}, without what there is not.
std::string to_text(const Probed& probed);
/// Error: no such text, numbers that are not finite.
Result<Probed> probed_from_text(std::string_view text);

}  // namespace telesplat::scene
