// What a headset's display is told before it begins.
#pragma once

#include <glm/vec3.hpp>
#include <optional>

namespace telesplat::viewer {

struct XrOptions {
  /// Where the room's origin, around which the data set stands, lies in the headset's space: metres, +y up. Nothing:
  /// what suits that space.
  std::optional<glm::dvec3> origin_m;
  double scale = 1;   ///< pixels drawn for each that the runtime recommends, on each axis
  bool depth = true;  ///< submit depth, if the runtime takes it
};

}  // namespace telesplat::viewer
