#include "services/data/base/placement_options.h"

#include <fmt/format.h>

namespace telesplat::data {

Result<glm::dmat3> rotation_for_up(const std::string& up, scene::Space space) {
  // Columns are the images of the data axes.
  using V = glm::dvec3;
  if (space == scene::Space::kRas) {
    // The axes x and y point the other way in LPS.
    const bool minus = up.starts_with('-'), turned = !up.ends_with('z');
    const auto lps = rotation_for_up((minus != turned ? "-" : "") + up.substr(minus ? 1 : 0));
    if (!lps) return rotation_for_up(up);
    return glm::dmat3(-(*lps)[0], -(*lps)[1], (*lps)[2]);
  }
  if (up == "y") return glm::dmat3(1.0);
  if (up == "-y") return glm::dmat3(V(1, 0, 0), V(0, -1, 0), V(0, 0, -1));
  if (up == "z") return glm::dmat3(V(1, 0, 0), V(0, 0, -1), V(0, 1, 0));
  if (up == "-z") return glm::dmat3(V(1, 0, 0), V(0, 0, 1), V(0, -1, 0));
  if (up == "x") return glm::dmat3(V(0, 1, 0), V(-1, 0, 0), V(0, 0, 1));
  if (up == "-x") return glm::dmat3(V(0, -1, 0), V(1, 0, 0), V(0, 0, 1));
  return Error{fmt::format("up axis '{}' is none of auto, x, y, z, -x, -y, -z", up)};
}

}  // namespace telesplat::data
