#include "client/displays/xr/xr_space.h"

#include <algorithm>
#include <cmath>

namespace telesplat::viewer {
namespace {

int pixels(double focal, double extent) {
  return std::clamp(int(std::lround(focal * extent)), 1, geometry::kMaxImageSide);
}

}  // namespace

geometry::Pose room_pose(const XrPosef& p, const glm::dvec3& origin) {
  const glm::dquat q(p.orientation.w, p.orientation.x, p.orientation.y, p.orientation.z);
  return {glm::dvec3(p.position.x, p.position.y, p.position.z) - origin, glm::normalize(q)};
}

geometry::Camera eye_camera(const XrView& view, const glm::dvec3& origin, int width, int height, double near_m) {
  geometry::Camera out;
  out.pose = room_pose(view.pose, origin);
  out.left = std::tan(view.fov.angleLeft), out.right = std::tan(view.fov.angleRight);
  out.bottom = std::tan(view.fov.angleDown), out.top = std::tan(view.fov.angleUp);
  out.width = width, out.height = height;
  out.near_m = near_m;
  return out;
}

// Depths are linear in the reciprocal.
double step_of_depth_m(double near_m, double far_m) { return (1 / near_m - 1 / far_m) / 65535; }

geometry::Camera both_eyes(const std::array<geometry::Camera, 2>& eyes) {
  geometry::Camera out = eyes[0];
  out.pose.orientation = glm::normalize(glm::slerp(eyes[0].pose.orientation, eyes[1].pose.orientation, 0.5));
  const glm::dvec3 middle = 0.5 * (eyes[0].pose.position_room + eyes[1].pose.position_room);
  const glm::dquat to_head = glm::conjugate(out.pose.orientation);
  // All directions that either eye sees, as tangents of the head's own axes.
  glm::dvec2 lo(1e9), hi(-1e9);
  glm::dvec3 apexes[2];
  for (int e = 0; e < 2; ++e) {
    const geometry::Camera& eye = eyes[size_t(e)];
    apexes[e] = to_head * (eye.pose.position_room - middle);
    const glm::dquat turn = to_head * eye.pose.orientation;
    for (const double u : {eye.left, eye.right})
      for (const double v : {eye.bottom, eye.top}) {
        const glm::dvec3 d = turn * glm::dvec3(u, v, -1);
        const glm::dvec2 tangent(d.x / -d.z, d.y / -d.z);
        lo = glm::min(lo, tangent), hi = glm::max(hi, tangent);
      }
  }
  // The apex (x, y, behind) sees the eye at a if lo (behind - a.z) <= a - (x, y) <= hi (behind - a.z), in both axes.
  glm::dvec2 most(-1e9), least(1e9);
  for (const auto& a : apexes) {
    most = glm::max(most, glm::dvec2(a) + hi * a.z);
    least = glm::min(least, glm::dvec2(a) + lo * a.z);
  }
  const glm::dvec2 needed = (most - least) / (hi - lo);
  const double behind = std::max({needed.x, needed.y, apexes[0].z, apexes[1].z});
  const glm::dvec2 aside = 0.5 * ((most - hi * behind) + (least - lo * behind));
  out.pose.position_room = middle + out.pose.orientation * glm::dvec3(aside, behind);
  out.left = lo.x, out.right = hi.x, out.bottom = lo.y, out.top = hi.y;
  out.width = pixels(std::max(eyes[0].focal_x(), eyes[1].focal_x()), hi.x - lo.x);
  out.height = pixels(std::max(eyes[0].focal_y(), eyes[1].focal_y()), hi.y - lo.y);
  return out;
}

}  // namespace telesplat::viewer
