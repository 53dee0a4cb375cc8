#include "common/geometry/camera.h"

#include <fmt/format.h>

#include <cmath>

namespace telesplat::geometry {

glm::dmat4 Camera::view() const {
  const glm::dmat3 to_camera = glm::mat3_cast(glm::conjugate(pose.orientation));
  glm::dmat4 m(to_camera);
  m[3] = glm::dvec4(-(to_camera * pose.position_room), 1.0);
  return m;
}

Camera::PixelTransform Camera::room_to_pixel() const {
  const glm::dmat4 v = view();
  const auto row = [&](int i) { return glm::dvec4(v[0][i], v[1][i], v[2][i], v[3][i]); };
  // depth w = -z;  u = x / w;  x_pix = (u - left) * focal_x;  y_pix = (top - y / w) * focal_y.
  const glm::dvec4 w = -row(2);
  return {focal_x() * (row(0) - left * w), focal_y() * (top * w - row(1)), w};
}

glm::dvec3 Camera::unproject(double x_pix, double y_pix, double depth_m) const {
  const double u = left + x_pix / focal_x(), v = top - y_pix / focal_y();
  return pose.position_room + pose.orientation * glm::dvec3(u * depth_m, v * depth_m, -depth_m);
}

Camera make_camera(const Pose& pose, double fov_x_deg, int width, int height, double near_m) {
  const double half_w = std::tan(fov_x_deg * 0.5 * 3.14159265358979323846 / 180.0);
  const double half_h = half_w * height / width;
  return {pose, -half_w, half_w, -half_h, half_h, near_m, width, height};
}

Status validate(const Camera& c) {
  const glm::dvec3 p = c.pose.position_room;
  const glm::dquat q = c.pose.orientation;
  for (double v : {p.x, p.y, p.z, q.w, q.x, q.y, q.z, c.left, c.right, c.bottom, c.top, c.near_m})
    if (!std::isfinite(v)) return Error{"camera holds a value that is not finite"};
  for (double v : {p.x, p.y, p.z})
    if (std::abs(v) > 1e6) return Error{fmt::format("camera position {} m is farther than 1e6 m from the origin", v)};
  if (std::abs(glm::length(q) - 1.0) > 0.01)
    return Error{fmt::format("camera orientation has length {} instead of 1", glm::length(q))};
  if (!(c.right - c.left > 1e-6) || !(c.top - c.bottom > 1e-6) || c.right > 1e3 || c.left < -1e3 || c.top > 1e3 ||
      c.bottom < -1e3)
    return Error{
        fmt::format("camera frustum [{}, {}] x [{}, {}] is empty or beyond 1000", c.left, c.right, c.bottom, c.top)};
  if (!(c.near_m >= 1e-6 && c.near_m <= 1e6))
    return Error{fmt::format("camera near {} m is outside [1e-6, 1e6]", c.near_m)};
  if (c.width < 1 || c.height < 1 || c.width > kMaxImageSide || c.height > kMaxImageSide)
    return Error{fmt::format("camera size {}x{} is outside 1..{}", c.width, c.height, kMaxImageSide)};
  return ok_status();
}

Frustum::Frustum(const Camera& c) {
  const auto t = c.room_to_pixel();
  const double width = c.width, height = c.height;
  const glm::dvec4 planes[5] = {t.x, width * t.w - t.x, height * t.w - t.y, t.y, t.w - glm::dvec4(0, 0, 0, c.near_m)};
  for (int i = 0; i < 5; ++i) planes_[i] = glm::vec4(planes[i] / glm::length(glm::dvec3(planes[i])));
}

bool Frustum::on_inner_sides(const Box& b, bool wholly) const {
  for (const glm::vec4& p : planes_) {
    const auto corner = [&](int axis) { return (p[axis] > 0) != wholly ? b.hi[axis] : b.lo[axis]; };
    if (p.x * corner(0) + p.y * corner(1) + p.z * corner(2) + p.w < 0) return false;
  }
  return true;
}

Camera crop(const Camera& c, const Rect& r) {
  Camera out = c;
  const double du = (c.right - c.left) / c.width, dv = (c.top - c.bottom) / c.height;
  out.left = c.left + r.x * du;
  out.right = c.left + (r.x + r.width) * du;
  out.top = c.top - r.y * dv;
  out.bottom = c.top - (r.y + r.height) * dv;
  out.width = r.width;
  out.height = r.height;
  return out;
}

Camera half_size(const Camera& c) {
  Camera out = c;
  out.width = (c.width + 1) / 2;
  out.height = (c.height + 1) / 2;
  out.right = c.left + 2.0 * out.width / c.width * (c.right - c.left);
  out.bottom = c.top - 2.0 * out.height / c.height * (c.top - c.bottom);
  return out;
}

Camera subsample(const Camera& c, int step) {
  Camera out = c;
  const double du = (c.right - c.left) / c.width, dv = (c.top - c.bottom) / c.height;
  // Centre of the first pixel of the result, less half of one of its pixels.
  const double first = step / 2 + 0.5 - step / 2.0;
  out.width = (c.width + step - 1) / step;
  out.height = (c.height + step - 1) / step;
  out.left = c.left + first * du;
  out.right = out.left + out.width * step * du;
  out.top = c.top - first * dv;
  out.bottom = out.top - out.height * step * dv;
  return out;
}

std::array<std::array<double, 3>, 3> ray_axes(const Camera& camera, const Rect& rect) {
  const double du = (camera.right - camera.left) / camera.width, dv = (camera.top - camera.bottom) / camera.height;
  const double u0 = camera.left + (rect.x + 0.5) * du, v0 = camera.top - (rect.y + 0.5) * dv;
  const glm::dvec3 by_column = camera.pose.orientation * glm::dvec3(du, 0, 0),
                   by_row = camera.pose.orientation * glm::dvec3(0, -dv, 0),
                   first = camera.pose.orientation * glm::dvec3(u0, v0, -1);
  std::array<std::array<double, 3>, 3> out;
  for (int i = 0; i < 3; ++i) out[static_cast<size_t>(i)] = {by_column[i], by_row[i], first[i]};
  return out;
}

}  // namespace telesplat::geometry
