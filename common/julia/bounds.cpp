#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "common/julia/distance.h"

namespace telesplat::julia {
namespace {

constexpr int kDepth = 9;  // finest cells are a 512th of the first cube

/// held[n]: only points with |q| <= held[n] can still have |q| <= bailout after n more iterations, because |q^2 + c| <=
/// b needs |q| <= sqrt(b + |c|). Falls towards radius(c).
std::vector<double> held_radii(const Parameters& p) {
  std::vector<double> held{p.bailout};
  for (int n = 0; n < p.iterations; ++n) held.push_back(std::sqrt(held.back() + glm::length(p.c)));
  return held;
}

// Finds the box of all finest cells that may hold a point of the set.
class BoxSearch {
 public:
  BoxSearch(const Parameters& parameters, const std::vector<double>& held, double half_side, bool any)
      : p_(parameters), held_(held), slice_(slice(parameters)), any_(any) {
    visit(glm::dvec3(0), half_side, 0);
  }
  const geometry::DBox& box() const { return box_; }

 private:
  // True if all orbits that begin in a ball of the slice escape. The iterates of a ball about q of radius r lie in
  // one of radius 2 |q| r + r^2 about q^2 + c. Unlike the distance estimate this needs no connected set.
  bool all_escape(const glm::dvec3& centre, double r) const {
    glm::dvec4 q = slice_.origin + centre.x * slice_.e[0] + centre.y * slice_.e[1] + centre.z * slice_.e[2];
    for (int n = 0;; ++n) {
      const double length = glm::length(q);
      if (length - r > held_[size_t(p_.iterations - n)]) return true;
      if (n == p_.iterations || r > 4 * held_.front()) return false;
      r = 2 * length * r + r * r;
      q = iterate(q, p_.c);
    }
  }

  void visit(const glm::dvec3& centre, double half, int depth) {
    const glm::dvec3 lo = centre - half, hi = centre + half;
    const auto known = [&] {  // true if this cell cannot change the result
      if (any_) return !box_.empty();
      return glm::all(glm::greaterThanEqual(lo, box_.lo)) && glm::all(glm::lessThanEqual(hi, box_.hi));
    };
    if (known() || all_escape(centre, half * std::sqrt(3.0))) return;
    if (depth == kDepth) return box_.extend({lo, hi});
    for (int child = 0; child < 8; ++child) {
      const glm::dvec3 side(child & 1 ? 0.5 : -0.5, child & 2 ? 0.5 : -0.5, child & 4 ? 0.5 : -0.5);
      visit(centre + half * side, half / 2, depth + 1);
    }
  }

  const Parameters& p_;
  const std::vector<double>& held_;
  Slice slice_;
  bool any_;  // one cell is enough
  geometry::DBox box_;
};

}  // namespace

double radius(const glm::dvec4& c) { return (1 + std::sqrt(1 + 4 * glm::length(c))) / 2; }

geometry::DBox bounds(const Parameters& parameters) {
  const auto held = held_radii(parameters);
  if (parameters.bound > 0) {
    const geometry::DBox cube{glm::dvec3(-parameters.bound), glm::dvec3(parameters.bound)};
    return BoxSearch(parameters, held, parameters.bound, true).box().empty() ? geometry::DBox{} : cube;
  }
  geometry::DBox box = BoxSearch(parameters, held, held.back(), false).box();
  const double margin = std::ldexp(2 * held.back(), -kDepth);
  if (!box.empty()) box = {box.lo - margin, box.hi + margin};
  return box;
}

Placement place(const geometry::DBox& box, double room_size_m) {
  CHECK(!box.empty());
  const glm::dvec3 size = box.size();
  Placement out;
  out.centre = box.centre();
  out.scale = room_size_m / std::max({size.x, size.y, size.z});
  out.box_room = {glm::vec3((box.lo - out.centre) * out.scale), glm::vec3((box.hi - out.centre) * out.scale)};
  return out;
}

}  // namespace telesplat::julia
