// The kernels `ellipse` and `ewa` in the plainest way: one point after the other, one pixel after the other.
#pragma once

#include <vector>

#include "common/splat/ewa/shading.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/surfel/splat.h"
#include "common/splat/tile_binning.h"

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

/// Keys of the image (pixel_key.h), row-major; kEmptyKey where nothing is.
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
