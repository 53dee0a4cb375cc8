#include "client/viewer/tracking/rotation.h"

#include <cmath>

namespace telesplat::tracking {

glm::dvec3 rotation_vector(glm::dquat q) {
  if (q.w < 0) q = -q;
  const glm::dvec3 v(q.x, q.y, q.z);
  const double s = glm::length(v);
  return s < 1e-9 ? 2.0 * v : v / s * 2.0 * std::atan2(s, q.w);
}

glm::dquat rotation(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle < 1e-9 ? glm::dquat(1, 0, 0, 0) : glm::angleAxis(angle, v / angle);
}

double angle_between(const glm::dquat& a, const glm::dquat& b) {
  return glm::length(rotation_vector(a * glm::conjugate(b)));
}

glm::dvec3 clamp_length(const glm::dvec3& v, double limit) {
  const double length = glm::length(v);
  return length > limit ? v * (limit / length) : v;
}

}  // namespace telesplat::tracking
