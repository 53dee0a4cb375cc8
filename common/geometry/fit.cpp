#include "common/geometry/fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace telesplat::geometry {
namespace {

constexpr int kSettle = 20;
constexpr double kFarthest_m = 2e5;  // from the box's centre: cameras farther than 1e6 m are refused

struct Shape {
  glm::dvec3 centre, half;  // metres
  double radius;            // radius of the upright cylinder around it
};

Shape shape_of(const Box& box) {
  const glm::dvec3 lo(box.lo), hi(box.hi), half = (hi - lo) * 0.5;
  return {(lo + hi) * 0.5, half, std::hypot(half.x, half.z)};
}

// Tangents of the picture's half sides, minus the margin.
glm::dvec2 half_tangents(const Camera& c) {
  return glm::max(glm::dvec2(std::min(-c.left, c.right), std::min(-c.bottom, c.top)), 1e-4) * (1 - kFitMargin);
}

// Finds an eye, looking along a given direction, that sees all corners: at `distance` from the centre against that
// direction, and `aside`, upwards in the picture. A corner p (right, up, towards the eye) is in the picture if
//   |p.x| <= tangent.x (distance - p.z)  and  |p.y - aside| <= tangent.y (distance - p.z).
class Demands {
 public:
  Demands(const glm::dvec2& tangents, double near_m) : tangents_(tangents), near_m_(near_m) {}

  void add(const glm::dvec3& p) {
    corners_.push_back(p);
    above_ = std::max(above_, p.z + p.y / tangents_.y);
    below_ = std::max(below_, p.z - p.y / tangents_.y);
    at_least(p.z + std::abs(p.x) / tangents_.x);
    at_least(p.z + near_m_ * 1.01);
  }
  void at_least(double distance) { least_ = std::max(least_, distance); }

  // Finds the height with equal room above and below, by bisection: a higher eye moves all corners down.
  double aside() const {
    double low = tangents_.y * (above_ - distance()), high = tangents_.y * (distance() - below_);
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      double upper = -1e300, lower = 1e300;
      for (const glm::dvec3& p : corners_) {
        const double v = (p.y - middle) / std::max(distance() - p.z, 1e-12);
        upper = std::max(upper, v), lower = std::min(lower, v);
      }
      (upper + lower > 0 ? low : high) = middle;
    }
    return (low + high) / 2;
  }
  double distance() const { return std::max(least_, (above_ + below_) / 2); }

 private:
  glm::dvec2 tangents_;
  std::vector<glm::dvec3> corners_;
  double near_m_, above_ = 0, below_ = 0, least_ = 0;
};

// The eye that meets the demands: its target, on the box's vertical axis, and its distance from there.
struct Stand {
  glm::dvec3 target;
  double distance;
};

// The axes of a view: `back` leads to the eye.
struct Axes {
  glm::dvec3 back, right, up;
  explicit Axes(const glm::dvec3& to_eye)
      : back(to_eye),
        right(std::hypot(back.x, back.z) > 1e-9 ? glm::normalize(glm::dvec3(back.z, 0, -back.x)) : glm::dvec3(1, 0, 0)),
        up(glm::cross(back, right)) {}
};

// Calls use() for the corners of a box in a view's axes. Moving the eye aside, so that the target of depth d is seen at
// the tangent m, makes x + m d of each x; the condition |x + m d - m (d - z)| <= tangent (d - z) is that for a corner
// at x + m z, where z counts from the target. target_z: of the target, from the box's centre towards the eye.
template <class F>
void for_corners(const Shape& s, const Axes& axes, double middle_x, double target_z, F use) {
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = s.half * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const double z = glm::dot(p, axes.back);
    use(glm::dvec3(glm::dot(p, axes.right) + middle_x * (z - target_z), glm::dot(p, axes.up), z));
  }
}

// Pose at `distance` before the target, which is seen at the tangent middle_x.
Pose pose_before(const glm::dvec3& target, double distance, const Axes& axes, double middle_x) {
  glm::dmat3 turned(axes.right, axes.up, axes.back);
  return {target + axes.back * distance - axes.right * (middle_x * distance), glm::normalize(glm::quat_cast(turned))};
}

Stand stand_at(const Shape& s, const Demands& demands, double tilt_rad) {
  const double aside = std::clamp(demands.aside(), -kFarthest_m, kFarthest_m);
  const double distance = demands.distance() - aside * std::tan(tilt_rad);
  return {s.centre + glm::dvec3(0, aside / std::cos(tilt_rad), 0), std::clamp(distance, 1e-5, kFarthest_m)};
}

}  // namespace

double suitable_tilt_rad(const Box& box) {
  const Shape s = shape_of(box);
  const double slender = s.radius > 0 ? s.half.y / s.radius : 10.0;
  return (10 + 24 / (1 + slender * slender)) * 3.14159265358979323846 / 180;
}

Pose fitted_view(const Box& box, const Camera& frustum, double middle_x) {
  const Shape s = shape_of(box);
  const double tilt = suitable_tilt_rad(box);
  const Axes axes({0, std::sin(tilt), std::cos(tilt)});
  // The target decides how far the eye is moved aside, and that moves the target: the loop settles soon.
  Stand stand{s.centre, 0};
  for (int i = 0; i < (middle_x == 0 ? 1 : kSettle); ++i) {
    Demands demands(half_tangents(frustum), frustum.near_m);
    const double target_z = glm::dot(stand.target - s.centre, axes.back);
    for_corners(s, axes, middle_x, target_z, [&](const glm::dvec3& p) { demands.add(p); });
    stand = stand_at(s, demands, tilt);
  }
  return pose_before(stand.target, stand.distance, axes, middle_x);
}

Pose fitted_view_from(const glm::dvec3& back, const Box& box, const Camera& frustum, double middle_x) {
  const Shape s = shape_of(box);
  const Axes axes(back);
  const glm::dvec2 tangents = half_tangents(frustum);
  double distance = 1e-5;
  for_corners(s, axes, middle_x, 0, [&](const glm::dvec3& p) {
    distance = std::max(
        {distance, p.z + std::abs(p.x) / tangents.x, p.z + std::abs(p.y) / tangents.y, p.z + frustum.near_m * 1.01});
  });
  return pose_before(s.centre, std::min(distance, kFarthest_m), axes, middle_x);
}

Trajectory fitted_orbit(const Box& box, const Camera& frustum, double period_s) {
  const Shape s = shape_of(box);
  const double tilt = suitable_tilt_rad(box), sine = std::sin(tilt), cosine = std::cos(tilt);
  const glm::dvec2 tangents = half_tangents(frustum);
  // All corners pass along the two rims of the upright cylinder around the box. For `aside`, a rim's demand is linear
  // in cos a, so its nearest and its farthest point decide; for the width, the largest over a of
  //   y sin + r (cos a cos + |sin a| / tangent)  is  y sin + r sqrt(cos^2 + 1 / tangent^2).
  Demands demands(tangents, frustum.near_m);
  for (const double y : {-s.half.y, s.half.y})
    for (const double along : {-s.radius, s.radius})
      demands.add({0, y * cosine - along * sine, y * sine + along * cosine});
  demands.at_least(s.half.y * sine + s.radius * std::hypot(cosine, 1 / tangents.x));
  const Stand stand = stand_at(s, demands, tilt);
  return Trajectory::orbit(stand.distance * cosine, stand.distance * sine, period_s, stand.target);
}

}  // namespace telesplat::geometry
