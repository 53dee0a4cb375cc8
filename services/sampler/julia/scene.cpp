#include "services/sampler/julia/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/core/check.h"
#include "common/image/shading.h"

namespace telesplat::sampler {
namespace {

// Returns an orthonormal basis of the vectors (i, j, k) that begins with the direction of `v`.
glm::dmat3 basis_along(const glm::dvec3& v) {
  const double length = glm::length(v);
  const glm::dvec3 a = length > 0 ? v / length : glm::dvec3(1, 0, 0);
  const glm::dvec3 other = std::abs(a.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 b = glm::normalize(glm::cross(a, other));
  return {a, b, glm::cross(a, b)};
}

}  // namespace

JuliaScene::JuliaScene(const julia::Parameters& parameters, const julia::Placement& placement,
                       const geometry::Clip& clip)
    : centre_(placement.centre), units_per_metre_(1 / placement.scale), palette_(parameters.palette) {
  CHECK(palette_ >= 0 && palette_ < static_cast<int>(julia::palette_names().size()));
  const glm::dvec3 v(parameters.c);
  const glm::dmat3 basis = basis_along(v);
  const auto orbit = [&](const glm::dvec4& q) { return 2.0 * glm::dvec4(q.w, glm::dvec3(q) * basis); };
  const julia::Slice slice = julia::slice(parameters);
  for (int i = 0; i < 3; ++i) axes_[i] = orbit(slice.e[i]);
  origin_ = orbit(slice.origin);

  const double radius = julia::radius(parameters.c), bailout = std::max(parameters.bailout, 1.01 * radius);
  Constants& k = constants_;
  k = {};
  k.c_w = static_cast<float>(2 * parameters.c.w);
  k.c_p = static_cast<float>(2 * glm::length(v));
  k.limit = static_cast<float>(4 * bailout * bailout);
  k.iterations = parameters.iterations;
  k.radius = static_cast<float>(radius);
  k.lod = static_cast<float>(parameters.lod);
  const glm::vec3 light = image::ShadingParameters{}.key_direction_room;
  for (int i = 0; i < 3; ++i) {
    k.box_lo[i] = placement.box_room.lo[i], k.box_hi[i] = placement.box_room.hi[i];
    k.light[i] = light[i];
    k.plane[i] = static_cast<float>(basis[i].y);
    for (int j = 0; j < 4; ++j) k.axes[i][j] = static_cast<float>(axes_[i][j]);
  }
  for (const geometry::ClipPlane& plane : clip.planes) {
    if (k.planes == static_cast<int>(geometry::Clip::kMostPlanes)) break;
    for (int i = 0; i < 3; ++i) k.plane_normal[k.planes][i] = static_cast<float>(plane.normal[i]);
    k.plane_offset[k.planes++] = static_cast<float>(plane.offset);
  }
  k.units_per_metre = static_cast<float>(units_per_metre_);
  k.colour = static_cast<int>(parameters.colour);
  k.tone_scale = static_cast<float>(parameters.colour_scale / (2 * radius));
  k.tone_shift = static_cast<float>(parameters.colour_shift - std::floor(parameters.colour_shift));
  k.ambient = static_cast<float>(parameters.ambient);
  k.shadow = static_cast<float>(parameters.shadow);
}

glm::dvec4 JuliaScene::orbit_direction(const glm::dvec3& room) const {
  const glm::dvec3 d = room * units_per_metre_;
  return d.x * axes_[0] + d.y * axes_[1] + d.z * axes_[2];
}

glm::dvec4 JuliaScene::orbit_point(const glm::dvec3& room) const {
  return origin_ + orbit_direction(room + centre_ / units_per_metre_);
}

JuliaRays::JuliaRays(const JuliaScene& scene, const geometry::Camera& camera, const geometry::Rect& rect,
                     double footprint_px)
    : x0(rect.x / kJuliaBlock * kJuliaBlock),
      y0(rect.y / kJuliaBlock * kJuliaBlock),
      columns_of_blocks((rect.x + rect.width - x0 + kJuliaBlock - 1) / kJuliaBlock),
      rows_of_blocks((rect.y + rect.height - y0 + kJuliaBlock - 1) / kJuliaBlock),
      near_m(static_cast<float>(camera.near_m)) {
  const double pixel_x = 1 / camera.focal_x(), pixel_y = 1 / camera.focal_y();
  // Directions are sums of multiples of the camera's axes, all seven components alike.
  using Seven = std::array<double, 7>;
  const auto axis = [&](const glm::dvec3& camera_space) {
    const glm::dvec3 room = camera.pose.orientation * camera_space;
    const glm::dvec4 orbit = scene.orbit_direction(room);
    return Seven{orbit.x, orbit.y, orbit.z, orbit.w, room.x, room.y, room.z};
  };
  const Seven right = axis({1, 0, 0}), up = axis({0, 1, 0}), ahead = axis({0, 0, -1});
  // Fill directions of `count` pixels or blocks, the first at `first`, the others `step` apart, in pixels.
  const auto fill_columns = [&](std::array<std::vector<float>, 7>& to, double first, double step, int count) {
    for (int i = 0; i < 7; ++i) {
      to[i].resize(static_cast<size_t>(count));
      for (int n = 0; n < count; ++n)
        to[i][n] = static_cast<float>((camera.left + (first + n * step) * pixel_x) * right[i]);
    }
  };
  const auto fill_rows = [&](std::array<std::vector<float>, 7>& to, double first, double step, int count) {
    for (int i = 0; i < 7; ++i) {
      to[i].resize(static_cast<size_t>(count));
      for (int n = 0; n < count; ++n)
        to[i][n] = static_cast<float>(ahead[i] + (camera.top - (first + n * step) * pixel_y) * up[i]);
    }
  };
  const double middle = kJuliaBlock * 0.5;
  fill_columns(column, x0 + 0.5, 1, columns_of_blocks * kJuliaBlock + kPadding);
  fill_rows(row, y0 + 0.5, 1, rows_of_blocks * kJuliaBlock);
  fill_columns(block_column, x0 + middle, kJuliaBlock, columns_of_blocks + kPadding);
  fill_rows(block_row, y0 + middle, kJuliaBlock, rows_of_blocks);

  const glm::dvec4 orbit = scene.orbit_point(camera.pose.position_room);
  for (int i = 0; i < 4; ++i) origin[i] = static_cast<float>(orbit[i]);
  for (int i = 0; i < 3; ++i) origin[4 + i] = static_cast<float>(camera.pose.position_room[i]);
  footprint = static_cast<float>(pixel_x * footprint_px * scene.units_per_metre());

  // The farthest pixel centre of a block from its middle; a little more, for rounding. No point of the ball
  // lies deeper than `deepest`.
  const double reach = (kJuliaBlock - 1) * 0.5 * std::sqrt(pixel_x * pixel_x + pixel_y * pixel_y) * 1.001;
  const double radius = scene.constants().radius * 1.01;  // larger, to make estimates at its edge safe from rounding
  const double deepest = (glm::length(orbit) / 2 + radius) / scene.units_per_metre();
  ball = static_cast<float>(2 * radius);
  spread = static_cast<float>(reach * scene.units_per_metre());
  block_ball = static_cast<float>(2 * (radius + reach * scene.units_per_metre() * deepest));
  block_margin = static_cast<float>(reach * deepest);
}

}  // namespace telesplat::sampler
