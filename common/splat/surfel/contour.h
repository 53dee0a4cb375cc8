// Where a sample's footprint on the surface appears on the screen: a point, its normal and the view that sampled it
// give an ellipse of pixels and the slope of depth across it (T4.4.1, eq. 4.2-4.7).
// Based on: M. Zwicker, J. Raesaenen, M. Botsch, C. Dachsbacher, M. Pauly, "Perspective accurate splatting", Graphics
// Interface 2004. We project the footprint in its dual form: the conic's adjugate, p p^T - V for a centre p and a
// footprint V in space, needs neither a basis of the tangent plane nor matrices to be inverted, and gives the bounding
// box at once. The contour is the same.
//
// These are the plain functions; surfel-inl.h does the same operations in the same order on vectors, so that both give
// the same bits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "common/geometry/camera.h"

namespace telesplat::splat {

/// Cosine below which a sample's footprint no longer grows with the slope at which it was taken. Without a limit,
/// splats of samples taken at silhouettes would reach far beyond them.
inline constexpr float kMinSampledCosine = 0.35f;
/// Steepest surface, as the tangent of its angle to the screen, whose depth is followed across a splat: tan(78
/// degrees). Beyond it normals of 16 bits are too coarse to give the depth.
inline constexpr float kSteepest = 4.7f;
/// Footprint radius over distance is taken as this at most: larger splats are cut to their largest size on the screen
/// anyway, and no product overflows.
inline constexpr float kMaxRadiusOverDepth = 1.0f;

/// The camera figures that contours need. Camera axes: X right, Y down, Z forward; a point w (u, v, 1) lies at pixel
/// (focal_x u + centre_x, focal_y v + centre_y).
struct SurfelCamera {
  float focal_x = 1, focal_y = 1, centre_x = 0, centre_y = 0;
  float step_x = 1, step_y = 1;                     ///< 1 / focal
  std::array<float, 3> right{}, down{}, forward{};  ///< the axes in room space
};

inline SurfelCamera surfel_camera(const geometry::Camera& c) {
  const glm::dmat4 v = c.view();
  const auto axis = [&](int i, double sign) {
    return std::array{static_cast<float>(sign * v[0][i]), static_cast<float>(sign * v[1][i]),
                      static_cast<float>(sign * v[2][i])};
  };
  return {static_cast<float>(c.focal_x()),
          static_cast<float>(c.focal_y()),
          static_cast<float>(-c.left * c.focal_x()),
          static_cast<float>(c.top * c.focal_y()),
          static_cast<float>(1.0 / c.focal_x()),
          static_cast<float>(1.0 / c.focal_y()),
          axis(0, 1),
          axis(1, -1),
          axis(2, -1)};
}

/// How an item's samples were taken: the circle that each stands for where the surface faced the sampling view, and the
/// direction towards that view, unit length, in camera axes.
struct SurfelSource {
  float radius_m = 0;
  std::array<float, 3> to_eye{0, 0, -1};
};

inline float dot(const std::array<float, 3>& a, float x, float y, float z) { return (a[0] * x + a[1] * y) + a[2] * z; }

inline SurfelSource surfel_source(const SurfelCamera& c, float radius_m, const glm::vec3& to_eye_room) {
  const float x = to_eye_room.x, y = to_eye_room.y, z = to_eye_room.z;
  return {radius_m, {dot(c.right, x, y, z), dot(c.down, x, y, z), dot(c.forward, x, y, z)}};
}

/// Normal of 16 bits (image/normal.h) without its division and square root: 127 |x| + ... = 127, so coordinates are
/// whole numbers.
inline std::array<float, 3> surfel_normal(uint16_t code) {
  const float x = std::min(static_cast<float>(code & 255) - 127.0f, 127.0f),
              y = std::min(static_cast<float>(code >> 8) - 127.0f, 127.0f);
  const float z = (127.0f - std::abs(x)) - std::abs(y), fold = std::max(-z, 0.0f);
  return {x - std::copysign(fold, x), y - std::copysign(fold, y), z};
}

/// The footprint on the screen, in pixels. A pixel at offset d from the contour's centre is inside if d^T S^-1 d <= 1.
struct SurfelContour {
  float offset_x = 0, offset_y = 0;  ///< of the ellipse's centre from the projected centre of the splat
  float xx = 0, xy = 0, yy = 0;      ///< S
  float slope_x = 0, slope_y = 0;  ///< depth of the tangent plane = w / (1 + slope . offset from the projected centre)
  std::array<float, 3> normal{0, 0, -1};  ///< in camera axes, not of unit length
};

/// With m the normal, i = 1 / m.m, n n^T = i m m^T, e the direction to the sampling view and d = e - (e.n) n, the
/// footprint is
///   V = radius^2 (I - n n^T + kappa d d^T),  kappa = 1 / max((e.n)^2, kMinSampledCosine^2)
/// a circle stretched along the slope by 1 / (e.n), or by sqrt(1 + |d|^2 / kMinSampledCosine^2) beyond the limit. With
/// T the shift of image coordinates by (u, v), s = T m, t = T d:
///   G = T T^T - i s s^T + kappa t t^T,   dual conic about the projected centre: diag(0, 0, 1) - (radius / w)^2 G
/// and its centre and S follow as k = 1 - (radius / w)^2 Gzz divides. Where the splat reaches the eye (k < 1/4) its
/// projection is taken as parallel.
///   x_pix, y_pix, w: the projected centre. normal_room: see surfel_normal. No low-pass is added to S.
inline SurfelContour surfel_contour(const SurfelCamera& c, const SurfelSource& source, float x_pix, float y_pix,
                                    float w, const std::array<float, 3>& normal_room) {
  const auto [nx, ny, nz] = normal_room;
  const float mx = dot(c.right, nx, ny, nz), my = dot(c.down, nx, ny, nz), mz = dot(c.forward, nx, ny, nz);
  const auto [ex, ey, ez] = source.to_eye;
  const float u = (x_pix - c.centre_x) * c.step_x, v = (y_pix - c.centre_y) * c.step_y;

  const float sx = mx - u * mz, sy = my - v * mz;
  const float i = 1.0f / ((mx * mx + my * my) + mz * mz);
  const float em = (mx * ex + my * ey) + mz * ez, em_i = em * i;
  const float kappa = 1.0f / std::max(em * em_i, kMinSampledCosine * kMinSampledCosine);
  const float tx = (ex - u * ez) - em_i * sx, ty = (ey - v * ez) - em_i * sy, tz = ez - em_i * mz;

  const float isx = i * sx, isy = i * sy, isz = i * mz, ktx = kappa * tx, kty = kappa * ty, ktz = kappa * tz;
  const float gxx = ((1.0f + u * u) - isx * sx) + ktx * tx, gyy = ((1.0f + v * v) - isy * sy) + kty * ty;
  const float gxy = (u * v - isx * sy) + ktx * ty;
  const float gxz = (ktx * tz - isx * mz) - u, gyz = (kty * tz - isy * mz) - v, gzz = (1.0f - isz * mz) + ktz * tz;

  const float rho = std::min(source.radius_m / w, kMaxRadiusOverDepth), rho2 = rho * rho;
  const float k = 1.0f - rho2 * gzz;
  const bool parallel = k < 0.25f;
  const float a = rho2 / (parallel ? 1.0f : k), shift = parallel ? 0.0f : a;
  const float ax = a * c.focal_x, ay = a * c.focal_y;

  SurfelContour out;
  out.offset_x = -((shift * c.focal_x) * gxz), out.offset_y = -((shift * c.focal_y) * gyz);
  out.xx = (ax * c.focal_x) * gxx + out.offset_x * out.offset_x;
  out.xy = (ax * c.focal_y) * gxy + out.offset_x * out.offset_y;
  out.yy = (ay * c.focal_y) * gyy + out.offset_y * out.offset_y;

  // The tangent plane m . P = m . p, P on the ray through the pixel. Seen edge-on it has no depth to follow: it gets
  // the steepest.
  const float along = (mx * u + my * v) + mz;
  const float inverse = 1.0f / std::copysign(std::max(std::abs(along), 1e-3f), along);
  const float limit_x = kSteepest * c.step_x, limit_y = kSteepest * c.step_y;
  out.slope_x = std::clamp((mx * inverse) * c.step_x, -limit_x, limit_x);
  out.slope_y = std::clamp((my * inverse) * c.step_y, -limit_y, limit_y);
  out.normal = {mx, my, mz};
  return out;
}

}  // namespace telesplat::splat
