#include "client/wall/screen_camera.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace telesplat::wall {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWidest_rad = 50 * kPi / 180;  // widest view to each side, for walls that are not plane
constexpr double kMostTangent = 500;            // geometry::validate() refuses frusta that reach beyond 1000
constexpr double kLeastTangent = 0.05;          // least distance of a fitted view's middle from its edges
constexpr double kPlane_m = 1e-6;

geometry::Pose compose(const geometry::Pose& outer, const geometry::Pose& inner) {
  return {outer.position_room + outer.orientation * inner.position_room, outer.orientation * inner.orientation};
}

glm::dvec3 into(const geometry::Pose& pose, const glm::dvec3& point) {
  return glm::conjugate(pose.orientation) * (point - pose.position_room);
}

std::array<glm::dvec3, 4> corners(const Screen& s) {
  const double x = s.width_m / 2, y = s.height_m / 2;
  std::array<glm::dvec3, 4> out;
  for (size_t i = 0; i < 4; ++i)
    out[i] = s.pose.position_room + s.pose.orientation * glm::dvec3(i & 1 ? x : -x, i & 2 ? y : -y, 0);
  return out;
}

// Edges of a view, as tangents from the eye; hold() widens them.
struct Edges {
  double left = std::numeric_limits<double>::max(), right = -left, bottom = left, top = -left;
  void hold(double u, double v) {
    left = std::min(left, u), right = std::max(right, u);
    bottom = std::min(bottom, v), top = std::max(top, v);
  }
};

Edges edges_of_plane(const Wall& wall) {
  Edges out;
  for (const Screen& s : wall.screens)
    for (const glm::dvec3& corner : corners(s)) {
      const glm::dvec3 p = corner - wall.head;
      const double depth = std::max(-p.z, kNearestEye_m);
      out.hold(p.x / depth, p.y / depth);
    }
  return out;
}

// Screens farther aside than kWidest_rad do not widen the view. Heights are tangents at the screen's own distance.
Edges edges_around(const Wall& wall) {
  Edges out;
  for (const Screen& s : wall.screens)
    for (const glm::dvec3& corner : corners(s)) {
      const glm::dvec3 p = corner - wall.head;
      const double away = std::max(std::hypot(p.x, p.z), kNearestEye_m);
      const double turn = std::clamp(std::atan2(p.x, -p.z), -kWidest_rad, kWidest_rad);
      out.hold(std::tan(turn), p.y / away);
    }
  return out;
}

}  // namespace

geometry::Pose wall_in_room(const Wall& wall, const geometry::Pose& head) {
  if (wall.anchor == Anchor::kRoom) return wall.in_room;
  return {head.position_room - head.orientation * wall.head, head.orientation};
}

geometry::Camera screen_camera(const Screen& s, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                               double near_m) {
  const geometry::Pose screen = compose(wall_in_room, s.pose);
  const glm::dvec3 eye = into(screen, eye_room);
  const double beside = std::max(std::abs(eye.x) + s.width_m, std::abs(eye.y) + s.height_m);
  const double distance = std::max({eye.z, kNearestEye_m, beside / kMostTangent});
  geometry::Camera out;
  out.pose = {eye_room, screen.orientation};
  out.left = (-s.width_m / 2 - eye.x) / distance;
  out.right = (s.width_m / 2 - eye.x) / distance;
  out.bottom = (-s.height_m / 2 - eye.y) / distance;
  out.top = (s.height_m / 2 - eye.y) / distance;
  out.near_m = near_m;
  out.width = s.width;
  out.height = s.height;
  return out;
}

geometry::Camera screen_camera(const Wall& wall, int screen, const geometry::Pose& head, double near_m) {
  return screen_camera(wall.screens.at(size_t(screen)), wall_in_room(wall, head), head.position_room, near_m);
}

std::optional<glm::dvec2> seen_at(const Screen& s, const geometry::Pose& wall_in_room, const glm::dvec3& eye_room,
                                  const glm::dvec3& point_room) {
  const geometry::Pose screen = compose(wall_in_room, s.pose);
  const glm::dvec3 eye = into(screen, eye_room), point = into(screen, point_room);
  const double depth = eye.z - point.z;
  if (eye.z < kNearestEye_m || depth <= 0) return std::nullopt;
  const double t = eye.z / depth;
  return glm::dvec2(eye.x + t * (point.x - eye.x), eye.y + t * (point.y - eye.y));
}

bool is_plane(const Wall& wall) {
  return std::all_of(wall.screens.begin(), wall.screens.end(), [&](const Screen& s) {
    return std::abs(s.pose.position_room.z - wall.screens[0].pose.position_room.z) < kPlane_m &&
           std::abs(std::abs(s.pose.orientation.w) - 1) < 1e-12;
  });
}

double shown_share(const Wall& wall, const geometry::Pose& head, const geometry::Box& box) {
  const geometry::Pose in_room = wall_in_room(wall, head);
  const auto on = [&](const Screen& s, const glm::dvec3& point) {
    const auto at = seen_at(s, in_room, head.position_room, point);
    return at && at->x >= -s.width_m / 2 - s.bezel.left && at->x <= s.width_m / 2 + s.bezel.right &&
           at->y >= -s.height_m / 2 - s.bezel.bottom && at->y <= s.height_m / 2 + s.bezel.top;
  };
  const auto shown = [&](double share) {
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 corner(i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z);
      const auto shows = [&](const Screen& s) { return on(s, share * corner); };
      if (std::none_of(wall.screens.begin(), wall.screens.end(), shows)) return false;
    }
    return true;
  };
  if (shown(1)) return 1;
  double low = 0, high = 1;
  for (int i = 0; i < 20; ++i) {
    const double middle = (low + high) / 2;
    (shown(middle) ? low : high) = middle;
  }
  return low;
}

geometry::Camera fitting_frustum(const Wall& wall, double near_m) {
  Edges e = is_plane(wall) ? edges_of_plane(wall) : edges_around(wall);
  e.left = std::clamp(e.left, -kMostTangent, -kLeastTangent),
  e.right = std::clamp(e.right, kLeastTangent, kMostTangent);
  e.bottom = std::clamp(e.bottom, -kMostTangent, -kLeastTangent);
  e.top = std::clamp(e.top, kLeastTangent, kMostTangent);
  double finest = 0;  // pixels a unit of tangent
  for (const Screen& s : wall.screens) {
    const double distance = glm::distance(s.pose.position_room, wall.head);
    finest = std::max(finest, s.width / s.width_m * distance);
  }
  const auto pixels = [&](double tangents) {
    return int(std::clamp(std::lround(tangents * finest), 16l, long(geometry::kMaxImageSide)));
  };
  return {{}, e.left, e.right, e.bottom, e.top, near_m, pixels(e.right - e.left), pixels(e.top - e.bottom)};
}

Result<Unrolled> unrolled(const Wall& wall) {
  Unrolled out;
  double pixel_m = std::numeric_limits<double>::max(), left = pixel_m, top = -pixel_m, right = -pixel_m,
         bottom = pixel_m;
  for (const Screen& s : wall.screens) {
    pixel_m = std::min({pixel_m, s.width_m / s.width, s.height_m / s.height});
    left = std::min(left, s.unrolled_m.x - s.width_m / 2), right = std::max(right, s.unrolled_m.x + s.width_m / 2);
    bottom = std::min(bottom, s.unrolled_m.y - s.height_m / 2), top = std::max(top, s.unrolled_m.y + s.height_m / 2);
  }
  const double across = std::round((right - left) / pixel_m), down = std::round((top - bottom) / pixel_m);
  if (!(std::max(across, down) <= geometry::kMaxImageSide))
    return Error{fmt::format("the wall {} unrolled has {:.0f}x{:.0f} pixels, limit {} a side", wall.name, across, down,
                             geometry::kMaxImageSide)};
  out.width = std::max(1, int(across)), out.height = std::max(1, int(down));
  out.metres_per_pixel = pixel_m;
  for (const Screen& s : wall.screens) {
    const int width = std::clamp(int(std::lround(s.width_m / pixel_m)), 1, out.width),
              height = std::clamp(int(std::lround(s.height_m / pixel_m)), 1, out.height);
    const double x = (s.unrolled_m.x - s.width_m / 2 - left) / pixel_m,
                 y = (top - s.unrolled_m.y - s.height_m / 2) / pixel_m;
    out.places.push_back({std::clamp(int(std::lround(x)), 0, out.width - width),
                          std::clamp(int(std::lround(y)), 0, out.height - height), width, height});
  }
  return out;
}

}  // namespace telesplat::wall
