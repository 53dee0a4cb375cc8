#include "common/geometry/ray_axes.h"

namespace telesplat::geometry {

std::array<std::array<double, 3>, 3> ray_axes(const Camera& camera, const Rect& rect) {
  const double du = (camera.right - camera.left) / camera.width, dv = (camera.top - camera.bottom) / camera.height;
  const double u0 = camera.left + (rect.x + 0.5) * du, v0 = camera.top - (rect.y + 0.5) * dv;
  const glm::dvec3 by_column = camera.pose.orientation * glm::dvec3(du, 0, 0),
                   by_row = camera.pose.orientation * glm::dvec3(0, -dv, 0),
                   first = camera.pose.orientation * glm::dvec3(u0, v0, -1);
  std::array<std::array<double, 3>, 3> out;
  for (int i = 0; i < 3; ++i) out[static_cast<size_t>(i)] = {by_column[i], by_row[i], first[i]};
  return out;
}

}  // namespace telesplat::geometry
