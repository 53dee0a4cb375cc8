#include "services/data/base/placement_options.h"

#include <fmt/format.h>

namespace telesplat::data {

Result<glm::dmat3> rotation_for_up(const std::string& up) {
  // Columns are the images of the data axes.
  using V = glm::dvec3;
  if (up == "y") return glm::dmat3(1.0);
  if (up == "-y") return glm::dmat3(V(1, 0, 0), V(0, -1, 0), V(0, 0, -1));
  if (up == "z") return glm::dmat3(V(1, 0, 0), V(0, 0, -1), V(0, 1, 0));
  if (up == "-z") return glm::dmat3(V(1, 0, 0), V(0, 0, 1), V(0, -1, 0));
  if (up == "x") return glm::dmat3(V(0, 1, 0), V(-1, 0, 0), V(0, 0, 1));
  if (up == "-x") return glm::dmat3(V(0, -1, 0), V(1, 0, 0), V(0, 0, 1));
  return Error{fmt::format("up axis '{}' is none of auto, x, y, z, -x, -y, -z", up)};
}

}  // namespace telesplat::data
