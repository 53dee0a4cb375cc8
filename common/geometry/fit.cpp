#include "common/geometry/fit.h"

#include <algorithm>
#include <cmath>

namespace telesplat::geometry {
namespace {

constexpr double kFarthest_m = 2e5;  // from the box's centre: cameras farther than 1e6 m are refused

struct Shape {
  glm::dvec3 centre, half;  // metres
  double radius;            // of the upright cylinder around it
};

Shape shape_of(const Box& box) {
  const glm::dvec3 lo(box.lo), hi(box.hi), half = (hi - lo) * 0.5;
  return {(lo + hi) * 0.5, half, std::hypot(half.x, half.z)};
}

// Tangents of the picture's half sides, less the margin.
glm::dvec2 half_tangents(const Camera& c) {
  return glm::max(glm::dvec2(std::min(-c.left, c.right), std::min(-c.bottom, c.top)), 1e-4) * (1 - kFitMargin);
}

double sane(double distance_m) { return std::clamp(distance_m, 1e-5, kFarthest_m); }

glm::dvec3 direction(double tilt_rad) { return {0, std::sin(tilt_rad), std::cos(tilt_rad)}; }

// Distance of an eye from the centre so that a point of these coordinates in the camera (right, up, towards the eye)
// is in the picture: |right| <= tangent * (distance - towards), and so on.
double distance_for(const glm::dvec3& p, const glm::dvec2& tangents, double near_m) {
  return p.z + std::max({std::abs(p.x) / tangents.x, std::abs(p.y) / tangents.y, near_m * 1.01});
}

}  // namespace

double suitable_tilt_rad(const Box& box) {
  const Shape s = shape_of(box);
  const double slender = s.radius > 0 ? s.half.y / s.radius : 10.0;
  return (10 + 24 / (1 + slender * slender)) * 3.14159265358979323846 / 180;
}

Pose fitted_view(const Box& box, const Camera& frustum) {
  const Shape s = shape_of(box);
  const glm::dvec3 back = direction(suitable_tilt_rad(box)), right(1, 0, 0), up = glm::cross(back, right);
  const glm::dvec2 tangents = half_tangents(frustum);
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = s.half * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    distance = std::max(
        distance, distance_for({glm::dot(p, right), glm::dot(p, up), glm::dot(p, back)}, tangents, frustum.near_m));
  }
  return look_at(s.centre + back * sane(distance), s.centre);
}

Trajectory fitted_orbit(const Box& box, const Camera& frustum, double period_s) {
  const Shape s = shape_of(box);
  const double tilt = suitable_tilt_rad(box), sine = std::sin(tilt), cosine = std::cos(tilt);
  const glm::dvec2 tangents = half_tangents(frustum);
  // Of all points of the cylinder's two rims, which all corners pass along: those at the side need
  //   y sin + r (cos a cos + |sin a| / tangent),  largest over a:  y sin + r sqrt(cos^2 + 1 / tangent^2);
  // upwards it is linear in cos a, so the nearest and the farthest point of a rim decide.
  double distance = s.half.y * sine + s.radius * std::hypot(cosine, 1 / tangents.x);
  for (const double y : {-s.half.y, s.half.y})
    for (const double along : {-s.radius, s.radius})
      distance = std::max(
          distance, distance_for({0, y * cosine - along * sine, y * sine + along * cosine}, tangents, frustum.near_m));
  distance = sane(distance);
  return Trajectory::orbit(distance * cosine, distance * sine, period_s, s.centre);
}

}  // namespace telesplat::geometry
