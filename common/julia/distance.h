// Distance of a point from a quaternion Julia set, in plain double precision: the reference for faster methods.
// against.
#pragma once

#include "common/julia/parameters.h"

namespace telesplat::julia {

/// q^2 + c of quaternions (i, j, k, real).
inline glm::dvec4 iterate(const glm::dvec4& q, const glm::dvec4& c) {
  return glm::dvec4(2 * q.w * q.x, 2 * q.w * q.y, 2 * q.w * q.z, q.w * q.w - q.x * q.x - q.y * q.y - q.z * q.z) + c;
}

/// Distance estimate at p in set space: 0.5 |q| log|q| / |q'| at the first |q| > bailout of q0 = p, q <- q^2 + c, with
/// |q'| <- 2 |q| |q'| from 1; 0 if no |q| of the first 1 + iterations ones exceeds it. Near the set a lower bound of
/// the distance (Hart, Sandin, Kauffman: Ray tracing deterministic 3-D fractals, 1989). Not always a bound far from the
/// set, where |p| is above about 4, and between the parts of sets that are not connected.
double distance_estimate(const Parameters& parameters, const Slice& slice, const glm::dvec3& p);

}  // namespace telesplat::julia
