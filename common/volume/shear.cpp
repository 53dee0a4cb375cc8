#include "common/volume/shear.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace telesplat::volume {
namespace {

constexpr double kSteepest =
    8.0;  // limit of slopes, in voxels a voxel: they grow without end near the plane of the eye

// If the eye is near the grid or inside, slices nearer than this part of the farthest one's distance do not make the
// raster coarser.
constexpr double kNearPart = 0.4;

glm::dvec3 transform(const glm::dmat4& m, const glm::dvec3& p) { return m * glm::dvec4(p, 1); }
glm::dvec3 direction_of(const glm::dmat4& m, const glm::dvec3& d) { return m * glm::dvec4(d, 0); }

// Room-space direction of a display ray, at depth 1.
glm::dvec3 ray(const geometry::Camera& c, double x_pix, double y_pix) {
  return c.unproject(x_pix, y_pix, 1) - c.pose.position_room;
}

struct PrincipalAxis {
  int axis, direction;
};

// True if the ray from `eye` along d meets the grid's box in front.
bool meets_box(const Grid& grid, const glm::dvec3& eye, const glm::dvec3& d) {
  double enter = 0, leave = 1e300;
  for (int a = 0; a < 3; ++a) {
    const double lo = (-0.5 - eye[a]) / d[a], hi = (grid.size[size_t(a)] - 0.5 - eye[a]) / d[a];
    if (d[a] == 0 && (eye[a] < -0.5 || eye[a] > grid.size[size_t(a)] - 0.5)) return false;
    if (d[a] == 0) continue;
    enter = std::max(enter, std::min(lo, hi));
    leave = std::min(leave, std::max(lo, hi));
  }
  return enter < leave;
}

// Chooses the axis closest to the rays that meet the grid: compares the candidates' steepest rays, and the means of all
// rays, in room slopes.
PrincipalAxis choose_axis(const Grid& grid, std::span<const geometry::Camera> cameras, const glm::dmat4& to_index) {
  constexpr int kRays = 17;  // a side
  constexpr double kUseless = 16;
  glm::dvec3 length_m, sum[2]{}, most[2]{};
  for (int a = 0; a < 3; ++a) length_m[a] = glm::length(glm::dvec3(grid.index_to_room[a]));
  int rays = 0;
  const auto count = [&](const glm::dvec3& d) {
    const glm::dvec3 m = d * length_m;
    ++rays;
    for (int a = 0; a < 3; ++a)
      for (const int forward : {0, 1}) {
        const double along = forward ? m[a] : -m[a], across = std::hypot(m[(a + 1) % 3], m[(a + 2) % 3]);
        const double slope = along > 0 ? std::min(across / along, kUseless) : kUseless;
        sum[forward][a] += slope;
        most[forward][a] = std::max(most[forward][a], slope);
      }
  };
  for (const auto& camera : cameras) {
    const glm::dvec3 eye = transform(to_index, camera.pose.position_room);
    for (int y = 0; y < kRays; ++y)
      for (int x = 0; x < kRays; ++x) {
        const glm::dvec3 d =
            direction_of(to_index, ray(camera, camera.width * (x + 0.5) / kRays, camera.height * (y + 0.5) / kRays));
        if (meets_box(grid, eye, d)) count(d);
      }
  }
  // If the grid falls between the rays, takes the ray through its centre.
  const glm::dvec3 centre((grid.size[0] - 1) / 2.0, (grid.size[1] - 1) / 2.0, (grid.size[2] - 1) / 2.0);
  if (rays == 0) count(centre - transform(to_index, cameras[0].pose.position_room));
  PrincipalAxis best{2, 1};
  double least = 1e300;
  for (int a = 0; a < 3; ++a)
    for (const int forward : {0, 1})
      if (const double score = most[forward][a] + sum[forward][a] / rays; score < least)
        least = score, best = {a, forward ? 1 : -1};
  return best;
}

struct Span {
  double lo = 1e300, hi = -1e300;
  void extend(double v) { lo = std::min(lo, v), hi = std::max(hi, v); }
};

// Clips the vertices of a convex polygon or polyhedron by a plane: keeps the part with distance(p) >= 0. Uses the
// edges of all pairs, which is cheap for few vertices and needs no adjacency.
void clip(std::vector<glm::dvec3>& vertices, const auto& distance) {
  std::vector<glm::dvec3> out;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const double a = distance(vertices[i]);
    if (a >= 0) out.push_back(vertices[i]);
    for (size_t j = i + 1; j < vertices.size(); ++j) {
      const double b = distance(vertices[j]);
      if ((a < 0) != (b < 0)) out.push_back(vertices[i] + (vertices[j] - vertices[i]) * (a / (a - b)));
    }
  }
  vertices = std::move(out);
}

// Slices [first, last) in front of the eye; equal if no slice is.
std::pair<int, int> slices_in_front(const ShearFrame& frame, int slices, double near_slices) {
  const double near = std::max(near_slices, 0.25);
  int begin = 0, end = slices;
  const double eye = frame.eye[frame.axis];  // may be any number
  if (frame.direction > 0)
    begin = int(std::ceil(std::clamp(eye + near, 0.0, double(slices))));
  else
    end = int(std::floor(std::clamp(eye - near, -1.0, slices - 1.0))) + 1;
  return {begin, std::max(begin, end)};
}

// The corners of the box [-1, n] between slices begin and end - 1, index space.
std::vector<glm::dvec3> corners_of_slices(const Grid& grid, const ShearFrame& frame, int begin, int end) {
  std::vector<glm::dvec3> out;
  for (int corner = 0; corner < 8; ++corner) {
    glm::dvec3 p;
    p[frame.axis] = corner & 1 ? end - 1 : begin;
    p[frame.u()] = corner & 2 ? grid.size[size_t(frame.u())] : -1.0;
    p[frame.v()] = corner & 4 ? grid.size[size_t(frame.v())] : -1.0;
    out.push_back(p);
  }
  return out;
}

// Keeps the part between the planes through the camera's eye and two neighbouring corner rays.
void clip_by_frustum(std::vector<glm::dvec3>& vertices, const geometry::Camera& camera, const glm::dmat4& to_index) {
  const glm::dvec3 eye = transform(to_index, camera.pose.position_room);
  const double w = camera.width, h = camera.height;
  const std::array<std::pair<double, double>, 4> corners{{{0, 0}, {w, 0}, {w, h}, {0, h}}};
  std::array<glm::dvec3, 4> rays{};
  for (size_t i = 0; i < 4; ++i) rays[i] = direction_of(to_index, ray(camera, corners[i].first, corners[i].second));
  const glm::dvec3 middle = direction_of(to_index, ray(camera, w / 2, h / 2));
  for (size_t i = 0; i < 4; ++i) {
    glm::dvec3 normal = glm::cross(rays[i], rays[(i + 1) % 4]);
    if (glm::dot(normal, middle) < 0) normal = -normal;  // inwards
    clip(vertices, [&](const glm::dvec3& p) { return glm::dot(p - eye, normal); });
  }
}

// Parts of some slices that cameras see: slopes of the rays, and the distances of the seen parts.
struct Seen {
  Span u, v;
  double nearest_t = 1e300, farthest_t = 0;
  bool empty() const { return !(u.hi > u.lo) || !(v.hi > v.lo); }
};

Seen see(const Grid& grid, const ShearFrame& frame, std::span<const geometry::Camera> cameras,
         const glm::dmat4& to_index, int begin, int end) {
  Seen out;
  const int u = frame.u(), v = frame.v();
  for (const auto& camera : cameras) {
    auto vertices = corners_of_slices(grid, frame, begin, end);
    clip_by_frustum(vertices, camera, to_index);
    for (const auto& p : vertices) {
      const double t = frame.t(p[frame.axis]);
      out.u.extend(std::clamp((p[u] - frame.eye[u]) / t, -kSteepest, kSteepest));
      out.v.extend(std::clamp((p[v] - frame.eye[v]) / t, -kSteepest, kSteepest));
      out.nearest_t = std::min(out.nearest_t, t);
      out.farthest_t = std::max(out.farthest_t, t);
    }
  }
  return out;
}

// Slope between pixels along index axis `of`: as fine as the display's pixels at the point where they are finest in
// slopes, which is where the display sees the principal axis most squarely: the raster's point nearest to slope 0.
double finest_pitch(const Grid& grid, const ShearFrame& frame, const Seen& seen, const geometry::Camera& display,
                    double finest, int of) {
  glm::dvec3 d;
  d[frame.axis] = frame.direction;
  d[frame.u()] = std::clamp(0.0, seen.u.lo, seen.u.hi);
  d[frame.v()] = std::clamp(0.0, seen.v.lo, seen.v.hi);
  const glm::dvec3 at = direction_of(grid.index_to_room, d);
  glm::dvec3 side(0.0);
  side[of] = 1;
  const glm::dvec3 across = direction_of(grid.index_to_room, side);
  // Compares the angle that one unit of slope spans there with that of a display pixel in its middle.
  const double distance = glm::length(at);
  const glm::dvec3 perpendicular = across - at * (glm::dot(across, at) / (distance * distance));
  const double angle_per_slope = glm::length(perpendicular) / distance;
  const double pixel_angle = 1 / std::max(display.focal_x(), display.focal_y());
  const double fine_enough = finest / std::max(seen.nearest_t, kNearPart * seen.farthest_t);
  return std::max(pixel_angle / std::max(angle_per_slope, 1e-12), fine_enough);
}

// Pixels of one side of the raster. Adds a pixel at both ends: look-ups between pixels reach half a pixel beyond the
// seen part. Without it pictures fade at their borders, which shows between the tiles of a wall. Enlarges `pitch` if
// the side would be too long.
int raster_side(const Span& slopes, double& pitch) {
  constexpr int kMost = kMaxRasterSide - 2;
  const double pixels = std::ceil((slopes.hi - slopes.lo) / pitch);
  if (pixels > kMost) pitch = (slopes.hi - slopes.lo) / kMost;
  return std::clamp(int(std::ceil((slopes.hi - slopes.lo) / pitch - 1e-9)), 1, kMost) + 2;
}

}  // namespace

glm::dvec3 ShearFrame::unproject(double x, double y, double at) const {
  glm::dvec3 out;
  out[axis] = at;
  out[u()] = eye[u()] + (u0 + x * du) * t(at);
  out[v()] = eye[v()] + (v0 + y * dv) * t(at);
  return out;
}

double ShearFrame::path(const Grid& grid, double x, double y) const {
  glm::dvec3 step;
  step[axis] = direction;
  step[u()] = u0 + x * du;
  step[v()] = v0 + y * dv;
  return glm::length(direction_of(grid.index_to_room, step)) / grid.unit_m();
}

std::optional<ShearFrame> plan_frame(const Grid& grid, std::span<const geometry::Camera> cameras,
                                     const PlanOptions& options) {
  if (cameras.empty()) return std::nullopt;
  const glm::dmat4 to_index = grid.room_to_index();
  ShearFrame out;
  out.eye = transform(to_index, cameras[0].pose.position_room);
  const auto [axis, direction] = choose_axis(grid, cameras, to_index);
  out.axis = axis;
  out.direction = direction;
  const int slices = grid.size[size_t(axis)];
  const auto [begin, end] = slices_in_front(out, slices, options.near_slices);
  if (begin >= end) return std::nullopt;
  const Seen seen = see(grid, out, cameras, to_index, begin, end);
  if (seen.empty()) return std::nullopt;

  out.du = finest_pitch(grid, out, seen, cameras[0], options.finest, out.u());
  out.dv = finest_pitch(grid, out, seen, cameras[0], options.finest, out.v());
  out.width = raster_side(seen.u, out.du);
  out.height = raster_side(seen.v, out.dv);
  out.u0 = seen.u.lo - out.du;
  out.v0 = seen.v.lo - out.dv;

  // Cuts layers at multiples of the same thickness, so that they stay in place when another part of the grid is in
  // front of the eye.
  const int layers = std::clamp(options.layers, 1, std::min(kMaxLayers, slices));
  for (int l = 0; l < layers; ++l) {
    const int from = std::max(begin, int(int64_t{slices} * l / layers));
    const int to = std::min(end, int(int64_t{slices} * (l + 1) / layers));
    if (from < to) out.layers.push_back({from, to, (from + to - 1) / 2.0});
  }
  if (direction < 0) std::reverse(out.layers.begin(), out.layers.end());
  return out;
}

Status validate(const ShearFrame& frame, const Grid& grid) {
  if (frame.axis < 0 || frame.axis > 2 || (frame.direction != 1 && frame.direction != -1))
    return Error{
        fmt::format("principal axis {} in direction {}: not 0 to 2 and +1 or -1", frame.axis, frame.direction)};
  if (frame.width < 1 || frame.height < 1 || frame.width > kMaxRasterSide || frame.height > kMaxRasterSide)
    return Error{fmt::format("a raster of {} x {} pixels, limits 1 and {}", frame.width, frame.height, kMaxRasterSide)};
  for (const double v : {frame.eye.x, frame.eye.y, frame.eye.z, frame.u0, frame.v0})
    if (!std::isfinite(v) || std::abs(v) > 1e9) return Error{fmt::format("{} in a shear, limit 1e9", v)};
  for (const double v : {frame.du, frame.dv})
    if (!(v >= 1e-9 && v <= 1e3)) return Error{fmt::format("a pixel of slope {}, limits 1e-9 and 1000", v)};
  if (frame.layers.empty() || frame.layers.size() > size_t(kMaxLayers))
    return Error{fmt::format("{} layers, limits 1 and {}", frame.layers.size(), kMaxLayers)};
  const int slices = grid.size[size_t(frame.axis)];
  int next = frame.direction > 0 ? 0 : slices;  // the next layer begins here or later
  for (const auto& l : frame.layers) {
    const bool in_order = frame.direction > 0 ? l.begin >= next : l.end <= next;
    if (l.begin < 0 || l.end > slices || l.begin >= l.end || !in_order)
      return Error{fmt::format("a layer of slices {} to {} of {} is empty, out of range or out of order", l.begin,
                               l.end, slices)};
    if (!(l.plane >= l.begin - 0.5 && l.plane <= l.end - 0.5))
      return Error{fmt::format("a layer of slices {} to {} stands at {}", l.begin, l.end, l.plane)};
    if (!(std::min(frame.t(l.begin), frame.t(l.end - 1)) >= 0.1))
      return Error{fmt::format("a layer of slices {} to {} is behind or too near to the eye at {}", l.begin, l.end,
                               frame.eye[frame.axis])};
    next = frame.direction > 0 ? l.end : l.begin;
  }
  return ok_status();
}

std::optional<glm::dmat3> warp(const Grid& grid, const ShearFrame& frame, double plane,
                               const geometry::Camera& display) {
  const glm::dmat4 to_index = grid.room_to_index();
  const glm::dvec3 eye = transform(to_index, display.pose.position_room);
  const double gap = plane - eye[frame.axis];
  const double t = frame.t(plane);
  if (std::abs(gap) < 1e-9 || !(t > 0)) return std::nullopt;
  // Index-space direction of the ray through (px, py) is d0 + px dx + py dy.
  const glm::dvec3 d0 = direction_of(to_index, ray(display, 0, 0));
  const glm::dvec3 dx = direction_of(to_index, ray(display, 1, 0)) - d0;
  const glm::dvec3 dy = direction_of(to_index, ray(display, 0, 1)) - d0;
  // It meets the plane at eye + d * gap / d_p, in front if d_p and gap have the same sign. Raster x = ((eye_u + d_u gap
  // / d_p - e_u) / t - u0) / du; times w = d_p * sign(gap) it is linear in (px, py).
  const double sign = gap > 0 ? 1 : -1;
  const auto row = [&](int of, double origin, double pitch) {
    const double a = gap / (t * pitch), b = ((eye[of] - frame.eye[of]) / t - origin) / pitch;
    const auto entry = [&](const glm::dvec3& d) { return sign * (a * d[of] + b * d[frame.axis]); };
    return glm::dvec3(entry(dx), entry(dy), entry(d0));
  };
  const glm::dvec3 x = row(frame.u(), frame.u0, frame.du), y = row(frame.v(), frame.v0, frame.dv);
  const glm::dvec3 w = sign * glm::dvec3(dx[frame.axis], dy[frame.axis], d0[frame.axis]);
  return glm::transpose(glm::dmat3(x, y, w));
}

std::pair<int, int> owned_pixels(const Grid& grid, const ShearFrame& frame, double slice, int k_begin, int k_end) {
  const bool rows = frame.axis == 0;  // then v is k
  const double t = frame.t(slice), eye = frame.eye[2];
  const double origin = rows ? frame.v0 : frame.u0, pitch = rows ? frame.dv : frame.du;
  const int pixels = rows ? frame.height : frame.width;
  // Returns the first pixel whose centre lies at or beyond k - 0.5.
  const auto first_at = [&](int k) {
    const double x = ((k - 0.5 - eye) / t - origin) / pitch - 0.5;
    return int(std::clamp(std::ceil(x), 0.0, double(pixels)));
  };
  return {k_begin <= 0 ? 0 : first_at(k_begin), k_end >= grid.size[2] ? pixels : first_at(k_end)};
}

}  // namespace telesplat::volume
