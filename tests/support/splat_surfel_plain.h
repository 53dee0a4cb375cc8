// The kernels `ellipse` and `ewa` in the simplest way: one point after the other, one pixel after the other, with the
// operations of surfel-inl.h, ellipse-inl.h and ewa-inl.h in the same order.
#pragma once

#include <vector>

#include "common/splat/ewa/shading.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/surfel/splat.h"
#include "common/splat/tile_binning.h"

namespace telesplat::splat {

/// The footprint on the screen, in pixels. A pixel at offset d from the contour's centre is inside if d^T S^-1 d <= 1.
struct SurfelContour {
  float offset_x = 0, offset_y = 0;  ///< ellipse's centre - projected centre of the splat
  float xx = 0, xy = 0, yy = 0;      ///< S
  float slope_x = 0, slope_y = 0;  ///< depth of the tangent plane = w / (1 + slope . offset from the projected centre)
  std::array<float, 3> normal{0, 0, -1};  ///< in camera axes, not of unit length
};

/// Computes the contour that surfel-inl.h describes.
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

  // The tangent plane m . P = m . p, P on the ray through the pixel. A plane seen edge-on has no depth there: it gets
  // the steepest slope.
  const float along = (mx * u + my * v) + mz;
  const float inverse = 1.0f / std::copysign(std::max(std::abs(along), 1e-3f), along);
  const float limit_x = kSteepest * c.step_x, limit_y = kSteepest * c.step_y;
  out.slope_x = std::clamp((mx * inverse) * c.step_x, -limit_x, limit_x);
  out.slope_y = std::clamp((my * inverse) * c.step_y, -limit_y, limit_y);
  out.normal = {mx, my, mz};
  return out;
}

/// Depth codes before rounding: 2^14 an octave, linear inside it.
inline float depth_code(float w, float near_m) {
  const auto bits = static_cast<int32_t>(std::bit_cast<uint32_t>(w) - std::bit_cast<uint32_t>(near_m));
  return static_cast<float>(bits) * (1.0f / (1 << kDepthCodeShift));
}

/// d^T S^-1 d = dx (xx dx + xy dy) + yy dy dy about (centre_x, centre_y), in pixels of the image.
struct SurfelConic {
  float centre_x = 0, centre_y = 0;
  float xx = 0, xy = 0, yy = 0;
  /// Pixels whose centres lie in its box, [x0, x1) x [y0, y1), cut to kMaxSplatSide.
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  float determinant = 0;  ///< det S

  float at(float dx, float dy) const { return dx * (xx * dx + xy * dy) + (yy * dy) * dy; }
};

/// The conic of grow S + add I.
inline SurfelConic surfel_conic(const SurfelContour& c, float x_pix, float y_pix, float grow, float add) {
  SurfelConic out;
  constexpr int kHalf = kMaxSplatSide / 2;
  // Not farther than the reach of binning.
  constexpr float kFarthest = kHalf - 1;
  out.centre_x = x_pix + std::clamp(c.offset_x, -kFarthest, kFarthest);
  out.centre_y = y_pix + std::clamp(c.offset_y, -kFarthest, kFarthest);
  const float xx = grow * c.xx + add, xy = grow * c.xy, yy = grow * c.yy + add;
  out.determinant = xx * yy - xy * xy;
  const float inverse = 1.0f / out.determinant;
  out.xx = yy * inverse, out.xy = (xy * -2.0f) * inverse, out.yy = xx * inverse;
  const auto bounds = [](float centre, float reach, int& first, int& last) {
    const int pixel = static_cast<int>(std::floor(centre));
    const float from = centre - 0.5f;
    first = std::max(static_cast<int>(std::ceil(from - reach)), pixel - (kHalf - 1));
    last = std::min(static_cast<int>(std::floor(from + reach)) + 1, pixel + kHalf + 1);
  };
  bounds(out.centre_x, std::sqrt(xx), out.x0, out.x1);
  bounds(out.centre_y, std::sqrt(yy), out.y0, out.y1);
  return out;
}

/// The depth code across a splat: centre + x dx + y dy, offsets from the conic's centre.
struct SurfelDepth {
  float centre = 0, x = 0, y = 0;
};
inline SurfelDepth surfel_depth(const SurfelContour& c, float w, float near_m) {
  const float scale = -codes_per_depth(w);
  const float x = scale * c.slope_x, y = scale * c.slope_y;
  return {(depth_code(w, near_m) + x * c.offset_x) + y * c.offset_y, x, y};
}

/// Factor of S in ewa's support, from det S = radius^4.
inline float ewa_growth(float determinant_of_s) {
  return std::max(kSupportGrowth - kSupportDrop / std::sqrt(std::max(determinant_of_s, 1e-12f)), 1.0f);
}

inline uint32_t surfel_spacing(float determinant_of_s, const SpacingLimits& limits) {
  return (determinant_of_s >= limits[0]) + (determinant_of_s >= limits[1]) + (determinant_of_s >= limits[2]);
}

/// ewa: weight in the splat's centre.
inline float ewa_peak(float determinant_of_v) { return 1.0f / std::min(determinant_of_v, 1e6f); }

}  // namespace telesplat::splat

namespace telesplat::testing {

/// Calls visit(item, index, source, x_pix, y_pix, w, contour) for every point beyond the near plane.
template <class Visit>
void for_surfels(const splat::DrawList& list, const geometry::Camera& camera, const Visit& visit) {
  const splat::SurfelCamera view = splat::surfel_camera(camera);
  const auto near_m = static_cast<float>(camera.near_m);
  for (const splat::DrawItem& item : list.items) {
    const splat::LeafTransform t = splat::leaf_transform(camera.room_to_pixel(), item.cluster->leaf_room);
    const splat::SurfelSource source = splat::surfel_source(view, item.radius_m, item.to_eye);
    for (uint32_t i = 0; i < item.level.count; ++i) {
      const float p[3] = {float(item.level.x[i]), float(item.level.y[i]), float(item.level.z[i])};
      const auto row = [&](const std::array<float, 4>& r) {
        return ((p[0] * r[0] + p[1] * r[1]) + p[2] * r[2]) + r[3];
      };
      const float w = row(t.w);
      if (!(w >= near_m)) continue;
      const float inverse = 1.0f / w, x = row(t.x) * inverse, y = row(t.y) * inverse;
      if (!(std::abs(x) < 1e5f && std::abs(y) < 1e5f)) continue;
      visit(item, i, source, x, y, w,
            splat::surfel_contour(view, source, x, y, w, splat::surfel_normal(item.level.normal[i])));
    }
  }
}

/// Calls pixel(x, y, q, dx, dy) for the pixels of a conic inside the image: those with q <= 1 and, if `centre`, always
/// the one that holds its centre.
template <class Pixel>
void for_pixels(const splat::SurfelConic& c, int width, int height, bool centre, const Pixel& pixel) {
  const int ix = int(std::floor(c.centre_x)), iy = int(std::floor(c.centre_y));
  const auto visit = [&](int x, int y, bool always) {
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const float dx = (float(x) + 0.5f) - c.centre_x, dy = (float(y) + 0.5f) - c.centre_y, q = c.at(dx, dy);
    if (q <= 1.0f || always) pixel(x, y, q, dx, dy);
  };
  for (int y = c.y0; y < c.y1; ++y)
    for (int x = c.x0; x < c.x1; ++x) visit(x, y, false);
  if (centre) visit(ix, iy, true);
}

/// Keys of the image (pixel_key.h), row-major; kEmptyKey for empty pixels.
inline std::vector<uint64_t> ellipse_plainly(const splat::DrawList& list, const geometry::Camera& camera) {
  std::vector<uint64_t> keys(size_t(camera.width) * camera.height, uint64_t(splat::kEmptyKey));
  const auto near_m = static_cast<float>(camera.near_m);
  const splat::SpacingLimits limits = splat::spacing_limits(list.scale);
  for_surfels(list, camera,
              [&](const splat::DrawItem& item, uint32_t i, const splat::SurfelSource& source, float x, float y, float w,
                  const splat::SurfelContour& contour) {
                const splat::SurfelConic conic = splat::surfel_conic(contour, x, y, 1.0f, splat::kOpaqueVariance);
                const splat::SurfelDepth depth = splat::surfel_depth(contour, w, near_m);
                const float bias = splat::ellipse_bias(source.radius_m, w);
                const uint32_t spacing =
                    splat::surfel_spacing(contour.xx * contour.yy - contour.xy * contour.xy, limits);
                for_pixels(conic, camera.width, camera.height, true, [&](int px, int py, float q, float dx, float dy) {
                  const float code = ((depth.centre + depth.x * dx) + depth.y * dy) + bias * std::min(q, 1.0f);
                  const auto whole = uint32_t(std::clamp(code, 0.0f, float(splat::kMaxDepthCode)));
                  const uint64_t key = splat::encode_key(whole, spacing, uint32_t(std::min(8.0f * q, 7.0f)),
                                                         item.level.normal[i], item.level.colour[i] & 0xffffff);
                  uint64_t& there = keys[size_t(py) * camera.width + px];
                  there = uint64_t(std::min(int64_t(there), int64_t(key)));
                });
              });
  return keys;
}

/// Pairs of the image (pixel_key.h): shaded colour and info, empty pixels as (0, kEmptyInfo).
inline std::vector<uint64_t> ewa_plainly(const splat::DrawList& list, const geometry::Camera& camera,
                                         const image::Shading& shading) {
  const size_t pixels = size_t(camera.width) * camera.height;
  std::vector<float> visible(pixels, INFINITY);
  const auto near_m = static_cast<float>(camera.near_m);
  for_surfels(list, camera,
              [&](const splat::DrawItem&, uint32_t, const splat::SurfelSource&, float x, float y, float w,
                  const splat::SurfelContour& contour) {
                const splat::SurfelConic conic = splat::surfel_conic(contour, x, y, 1.0f, splat::kOpaqueVariance);
                const splat::SurfelDepth depth = splat::surfel_depth(contour, w, near_m);
                for_pixels(conic, camera.width, camera.height, true, [&](int px, int py, float, float dx, float dy) {
                  float& there = visible[size_t(py) * camera.width + px];
                  there = std::min(there, (depth.centre + depth.x * dx) + depth.y * dy);
                });
              });
  std::vector<splat::EwaSum> sums(pixels);
  for_surfels(list, camera,
              [&](const splat::DrawItem& item, uint32_t i, const splat::SurfelSource& source, float x, float y, float w,
                  const splat::SurfelContour& contour) {
                const float det = contour.xx * contour.yy - contour.xy * contour.xy;
                const splat::SurfelConic conic =
                    splat::surfel_conic(contour, x, y, splat::ewa_growth(det), splat::kFilterVariance);
                const splat::SurfelDepth depth = splat::surfel_depth(contour, w, near_m);
                const float epsilon = splat::surfel_share(source.radius_m, w, splat::kEpsilonPerRadius,
                                                          splat::kLeastEpsilon, splat::kMostEpsilon);
                const float peak = splat::ewa_peak(conic.determinant);
                const uint32_t albedo = item.level.colour[i];
                for_pixels(conic, camera.width, camera.height, false, [&](int px, int py, float q, float dx, float dy) {
                  const size_t at = size_t(py) * camera.width + px;
                  const float code = (depth.centre + depth.x * dx) + depth.y * dy;
                  if (!(code - epsilon <= visible[at])) return;
                  const float t = 1.0f - q, t2 = t * t, weight = peak * (t2 * t2);
                  splat::EwaSum& s = sums[at];
                  s.red += weight * float(albedo >> 16 & 255), s.green += weight * float(albedo >> 8 & 255);
                  s.blue += weight * float(albedo & 255), s.weight += weight;
                  s.normal_x += weight * contour.normal[0], s.normal_y += weight * contour.normal[1];
                  s.normal_z += weight * contour.normal[2], s.depth_code += weight * depth.centre;
                });
              });
  const splat::EwaLight light = splat::ewa_light(shading.parameters(), splat::surfel_camera(camera));
  std::vector<uint64_t> pairs(pixels);
  for (size_t i = 0; i < pixels; ++i)
    pairs[i] = visible[i] < INFINITY
                   ? splat::encode_pair(splat::ewa_colour(sums[i], light), splat::ewa_depth_code(sums[i]) << 8)
                   : splat::encode_pair(0, splat::kEmptyInfo);
  return pairs;
}

}  // namespace telesplat::testing
