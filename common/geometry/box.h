// Axis-aligned boxes.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>

namespace telesplat::geometry {

/// Closed box [lo, hi]. The default one is empty: lo > hi.
template <class Vec>
struct BasicBox {
  Vec lo = Vec(std::numeric_limits<typename Vec::value_type>::max());
  Vec hi = Vec(std::numeric_limits<typename Vec::value_type>::lowest());

  void extend(const Vec& p) {
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  void extend(const BasicBox& b) {
    lo = glm::min(lo, b.lo);
    hi = glm::max(hi, b.hi);
  }
  bool empty() const { return lo.x > hi.x || lo.y > hi.y || lo.z > hi.z; }
  Vec centre() const { return (lo + hi) * typename Vec::value_type(0.5); }
  Vec size() const { return hi - lo; }
  bool operator==(const BasicBox&) const = default;
};

using Box = BasicBox<glm::vec3>;
using DBox = BasicBox<glm::dvec3>;

}  // namespace telesplat::geometry
