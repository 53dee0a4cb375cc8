#include "common/julia/distance.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace telesplat::julia {

double distance_estimate(const Parameters& parameters, const Slice& slice, const glm::dvec3& p) {
  glm::dvec4 q = slice.origin + p.x * slice.e[0] + p.y * slice.e[1] + p.z * slice.e[2];
  double derivative = 1, length = glm::length(q);
  for (int n = 0; length <= parameters.bailout; ++n) {
    if (n == parameters.iterations) return 0;
    derivative *= 2 * length;
    q = iterate(q, parameters.c);
    length = glm::length(q);
  }
  return 0.5 * length * std::log(length) / derivative;
}

}  // namespace telesplat::julia
