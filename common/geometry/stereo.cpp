#include "common/geometry/stereo.h"

#include <algorithm>
#include <cmath>

namespace telesplat::geometry {
namespace {

// One axis across the line of sight: the eyes' places on it, and the tangents of their frusta's two edges.
struct Axis {
  std::array<double, 2> place, low, high;
};

// The point behind the eyes from which one frustum holds both: its distance back, and its place on the axis.
struct Apex {
  double least_low, most_high;  // tangents of the edges
  double low_m, high_m;         // where these edges cross the plane of the first eye
  double back_m() const { return std::max(0.0, (high_m - low_m) / (most_high - least_low)); }
  double place(double back) const { return 0.5 * (low_m - least_low * back + high_m - most_high * back); }
};

// behind: distance of each eye behind the first one.
Apex apex_of(const Axis& axis, const std::array<double, 2>& behind) {
  Apex out{std::min(axis.low[0], axis.low[1]), std::max(axis.high[0], axis.high[1]), 0, 0};
  const auto low = [&](size_t i) { return axis.place[i] + out.least_low * behind[i]; };
  const auto high = [&](size_t i) { return axis.place[i] + out.most_high * behind[i]; };
  out.low_m = std::min(low(0), low(1));
  out.high_m = std::max(high(0), high(1));
  return out;
}

}  // namespace

glm::dvec3 seen_from(const Screen& screen, const glm::dvec3& point_room) {
  return glm::conjugate(screen.pose.orientation) * (point_room - screen.pose.position_room);
}

Screen screen_before(const Camera& c, double distance_m) {
  const glm::dvec3 middle(0.5 * (c.left + c.right), 0.5 * (c.bottom + c.top), -1);
  return {{c.pose.position_room + c.pose.orientation * (middle * distance_m), c.pose.orientation},
          (c.right - c.left) * distance_m,
          (c.top - c.bottom) * distance_m};
}

Camera camera_through(const Screen& screen, const glm::dvec3& eye_room, int width, int height, double near_m) {
  const glm::dvec3 eye = seen_from(screen, eye_room);
  const double half_w = 0.5 * screen.width_m, half_h = 0.5 * screen.height_m;
  return {{eye_room, screen.pose.orientation},
          (-half_w - eye.x) / eye.z,
          (half_w - eye.x) / eye.z,
          (-half_h - eye.y) / eye.z,
          (half_h - eye.y) / eye.z,
          near_m,
          width,
          height};
}

Camera enclosing_camera(const std::array<Camera, 2>& eyes) {
  const Camera &a = eyes[0], &b = eyes[1];
  const glm::dvec3 to_b =
      glm::conjugate(a.pose.orientation) * (b.pose.position_room - a.pose.position_room);  // in the first eye's axes
  const std::array<double, 2> behind{0, to_b.z};
  const Apex x = apex_of({{0, to_b.x}, {a.left, b.left}, {a.right, b.right}}, behind);
  const Apex y = apex_of({{0, to_b.y}, {a.bottom, b.bottom}, {a.top, b.top}}, behind);
  const double back = std::max({x.back_m(), y.back_m(), to_b.z, 0.0});
  Camera out = a;
  out.pose.position_room += a.pose.orientation * glm::dvec3(x.place(back), y.place(back), back);
  out.left = x.least_low, out.right = x.most_high;
  out.bottom = y.least_low, out.top = y.most_high;
  return out;
}

Camera widened_for(const Camera& head, const std::array<Camera, 2>& eyes, double nearest_m) {
  Camera out = head;
  const glm::dquat to_head = glm::conjugate(head.pose.orientation);
  for (const Camera& eye : eyes) {
    const glm::dvec3 aside = to_head * (eye.pose.position_room - head.pose.position_room);
    // An edge of the eye's frustum is seen from the head under tangents between those of its two ends: at the depth z
    // before the head it is eye + tangent (z + behind) aside.
    for (const double per_m : {0.0, 1 / nearest_m}) {
      out.left = std::min(out.left, eye.left + (aside.x + eye.left * aside.z) * per_m);
      out.right = std::max(out.right, eye.right + (aside.x + eye.right * aside.z) * per_m);
      out.bottom = std::min(out.bottom, eye.bottom + (aside.y + eye.bottom * aside.z) * per_m);
      out.top = std::max(out.top, eye.top + (aside.y + eye.top * aside.z) * per_m);
    }
  }
  const auto pixels = [](double n) { return std::clamp(int(std::ceil(n - 1e-6)), 1, kMaxImageSide); };
  out.width = pixels((out.right - out.left) * head.focal_x());
  out.height = pixels((out.top - out.bottom) * head.focal_y());
  return out;
}

}  // namespace telesplat::geometry
