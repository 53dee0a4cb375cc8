// Rotations as vectors: the axis, as long as the angle in radians.
#pragma once

#include "common/geometry/camera.h"

namespace telesplat::tracking {

/// Of a unit quaternion; the shorter way round, so at most pi long.
glm::dvec3 rotation_vector(glm::dquat q);
/// The unit quaternion that turns about `v` by its length in radians.
glm::dquat rotation(const glm::dvec3& v);
/// Radians between two orientations, 0 to pi.
double angle_between(const glm::dquat& a, const glm::dquat& b);
/// `v`, or a vector of its direction that is `limit` long where it is longer.
glm::dvec3 clamp_length(const glm::dvec3& v, double limit);

}  // namespace telesplat::tracking
