#include "common/geometry/stereo.h"

namespace telesplat::geometry {

std::array<Camera, 2> eye_cameras(const Camera& head, double distance_m) {
  std::array<Camera, 2> eyes{head, head};
  const glm::dvec3 half = head.pose.orientation * glm::dvec3(0.5 * distance_m, 0, 0);
  eyes[0].pose.position_room -= half;
  eyes[1].pose.position_room += half;
  return eyes;
}

Camera enclosing_camera(const Camera& head, double distance_m) {
  Camera out = head;
  // The left eye's left edge and the right eye's right edge meet this far behind the head.
  out.pose.position_room += head.pose.orientation * glm::dvec3(0, 0, distance_m / (head.right - head.left));
  // Where the frustum is off-axis they do not meet behind the head's middle, but beside it.
  out.pose.position_room -=
      head.pose.orientation * glm::dvec3(0.5 * distance_m * (head.right + head.left) / (head.right - head.left), 0, 0);
  return out;
}

}  // namespace telesplat::geometry
