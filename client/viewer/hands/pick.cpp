#include "client/viewer/hands/pick.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <vector>

#include "common/core/within.h"
#include "common/image/normal.h"
#include "common/splat/facing.h"

namespace telesplat::viewer {
namespace {

// Points whose depth is within this share of the nearest one's are on the same surface.
constexpr double kSameSurface = 0.01;
// A tangent plane seen more edge-on than this says too little about where the ray meets the surface.
constexpr double kLeastLean = 0.15;
// Points count as near the pixel within this share of their splat's size plus a pixel: between four samples of a
// lattice the farthest place is 0.71 of their distance away, and the finish fills the gaps between splats.
constexpr double kReach = 0.75;

struct Candidate {
  glm::dvec3 position_room;
  glm::dvec3 normal_room;
  uint32_t colour;
  double depth_m, radius_m;
  double distance2_px, reach_px;
};

// Adds the points of an item that lie near the pixel.
void add_candidates(const splat::DrawItem& item, const geometry::Camera& camera, double x_pix, double y_pix,
                    std::vector<Candidate>& out) {
  const geometry::Box& leaf = item.cluster->leaf_room;
  const glm::dvec3 lo(leaf.lo), eye = camera.pose.position_room;
  const double step = (double{leaf.hi.x} - double{leaf.lo.x}) / 65536;
  const auto [rx, ry, rw] = camera.room_to_pixel();
  const double reach_px = kReach * double{item.splat_px} + 1;
  const glm::vec3 facing = splat::facing_vector(splat::leaf_view(leaf, glm::vec3(eye)));
  for (uint32_t i = 0; i < item.level.count; ++i) {
    const glm::dvec3 p = lo + (glm::dvec3(item.level.x[i], item.level.y[i], item.level.z[i]) + glm::dvec3(0.5)) * step;
    const glm::dvec4 h(p, 1);
    const double w = glm::dot(rw, h);
    if (w < camera.near_m) continue;
    const double dx = glm::dot(rx, h) / w - x_pix, dy = glm::dot(ry, h) / w - y_pix;
    const double distance2 = dx * dx + dy * dy;
    if (distance2 > reach_px * reach_px) continue;
    const glm::vec3 n = image::octahedral16(item.level.normal[i]);
    if (item.may_face_away && glm::dot(n, facing) < -glm::length(n)) continue;
    out.push_back({p, glm::normalize(glm::dvec3(n)), item.level.colour[i] & 0xffffff, w,
                   reach_px * w / camera.focal_x(), distance2, reach_px});
  }
}

// Returns the depth at which the pixel's ray meets the candidate's tangent plane; its own depth if that is too far off.
double depth_on_plane(const Candidate& c, const geometry::Camera& camera, double x_pix, double y_pix) {
  const glm::dvec3 eye = camera.pose.position_room, ray = camera.unproject(x_pix, y_pix, 1) - eye;
  const double lean = glm::dot(c.normal_room, ray);
  if (std::abs(lean) < kLeastLean * glm::length(ray)) return c.depth_m;
  const double depth_m = glm::dot(c.normal_room, c.position_room - eye) / lean;
  return std::abs(depth_m - c.depth_m) <= c.radius_m / kLeastLean ? depth_m : c.depth_m;
}

double channel(uint32_t texel, int shift) { return double(texel >> shift & 255); }

// Interpolates a layer between four texels: red, green, blue, alpha in 0 to 255, premultiplied.
glm::dvec4 look_up(const volume::LayerImage& image, double x, double y) {
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  const double from_left = left - image.rect.x, from_top = top - image.rect.y;
  glm::dvec4 out(0);
  // For a ray along the layer, these numbers may be too large for int.
  if (!(from_left >= -1 && from_top >= -1 && from_left < image.rect.width && from_top < image.rect.height)) return out;
  const int x0 = int(from_left), y0 = int(from_top);
  for (int n = 0; n < 4; ++n) {
    const int dx = n & 1, dy = n >> 1;
    const double fx = x - 0.5 - left, fy = y - 0.5 - top;
    const uint32_t texel = image.row(y0 + dy)[x0 + dx];
    const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
    out += weight * glm::dvec4(channel(texel, 16), channel(texel, 8), channel(texel, 0), channel(texel, 24));
  }
  return out;
}

uint32_t packed(const glm::dvec4& premultiplied) {
  const double scale = premultiplied.w > 0 ? 255 / premultiplied.w : 0;
  uint32_t out = 0;
  for (int c = 0; c < 3; ++c) out = out << 8 | uint32_t(within(premultiplied[c] * scale + 0.5, 0.0, 255.0));
  return out;
}

// Depths along the camera's axis between which the ray is in the slices of a layer, [near, far).
struct Depths {
  double near_m, far_m;
};
Depths depths_of(const volume::VolumeFrame& frame, const volume::Layer& layer, const geometry::Camera& camera,
                 double x_pix, double y_pix) {
  const glm::dmat4 to_index = frame.grid.room_to_index();
  const glm::dvec3 eye = camera.pose.position_room, ray = camera.unproject(x_pix, y_pix, 1) - eye;
  const int p = frame.shear.axis;
  const double from = (to_index * glm::dvec4(eye, 1))[p], along = (to_index * glm::dvec4(ray, 0))[p];
  if (!(std::abs(along) > 0)) return {0, std::numeric_limits<double>::infinity()};
  const double a = (layer.begin - 0.5 - from) / along, b = (layer.end - 0.5 - from) / along;
  return {std::max(std::min(a, b), 0.0), std::max(a, b)};
}

void set_ray(Pick& pick, const geometry::Camera& camera, double x_pix, double y_pix) {
  pick.origin_room = camera.unproject(x_pix, y_pix, camera.near_m);
  pick.direction_room = glm::normalize(camera.unproject(x_pix, y_pix, 1) - camera.pose.position_room);
}

}  // namespace

geometry::Camera pick_camera(const geometry::Camera& camera, double x_pix, double y_pix) {
  const int side = 2 * kPickReach + 1;
  return geometry::crop(camera, {int(std::floor(x_pix)) - kPickReach, int(std::floor(y_pix)) - kPickReach, side, side});
}

std::optional<Pick> pick_point(const splat::DrawList& list, const geometry::Camera& camera, double x_pix,
                               double y_pix) {
  std::vector<Candidate> near;
  for (const splat::DrawItem& item : list.items) add_candidates(item, camera, x_pix, y_pix, near);
  if (near.empty()) return std::nullopt;
  double least_m = std::numeric_limits<double>::infinity();
  for (const Candidate& c : near) least_m = std::min(least_m, c.depth_m);
  const Candidate* best = nullptr;
  for (const Candidate& c : near) {
    if (c.depth_m > least_m * (1 + kSameSurface) + c.radius_m) continue;
    if (!best || c.distance2_px < best->distance2_px) best = &c;
  }
  Pick out;
  out.depth_m = depth_on_plane(*best, camera, x_pix, y_pix);
  out.position_room = camera.unproject(x_pix, y_pix, out.depth_m);
  out.normal_room = best->normal_room;
  out.colour = best->colour;
  out.spacing_m = best->radius_m;
  set_ray(out, camera, x_pix, y_pix);
  return out;
}

std::optional<Pick> pick_volume(const volume::VolumeFrame& frame, const geometry::Camera& camera, double x_pix,
                                double y_pix, double opacity) {
  const glm::dvec3 eye_index(frame.grid.room_to_index() * glm::dvec4(camera.pose.position_room, 1));
  glm::dvec4 sum(0);  // visible part of the colours, and the hidden share, in 1/255
  for (const int at : volume::front_to_back(frame, eye_index)) {
    const volume::LayerImage& image = frame.layers[size_t(at)];
    const volume::Layer& layer = frame.shear.layers[size_t(image.layer)];
    const auto warp = volume::warp(frame.grid, frame.shear, layer.plane, camera);
    if (!warp) continue;
    const glm::dvec3 raster = *warp * glm::dvec3(x_pix, y_pix, 1);
    if (!(raster.z > 0)) continue;
    const glm::dvec4 texel = look_up(image, raster.x / raster.z, raster.y / raster.z);
    const double before = sum.w / 255;
    sum += texel * (1 - before);
    if (sum.w / 255 < opacity || !(texel.w > 0)) continue;
    const Depths depths = depths_of(frame, layer, camera, x_pix, y_pix);
    if (depths.far_m < camera.near_m) continue;
    const double share = within((opacity - before) / (sum.w / 255 - before), 0.0, 1.0);
    Pick out;
    out.depth_m = std::max(depths.near_m + share * (depths.far_m - depths.near_m), camera.near_m);
    out.position_room = camera.unproject(x_pix, y_pix, out.depth_m);
    out.colour = packed(sum);
    out.spacing_m = (depths.far_m - depths.near_m) / 2;
    set_ray(out, camera, x_pix, y_pix);
    return out;
  }
  return std::nullopt;
}

}  // namespace telesplat::viewer
